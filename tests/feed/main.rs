//! Tests of the room `feed`: closed forms, published figures, limits seen from outside.

mod profile;
//mod support;
mod support {
    pub struct Random(u64);
    impl Random {
        pub fn new(seed: u64) -> Self {
            Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1)
        }
        pub fn unit(&mut self) -> f64 {
            self.0 ^= self.0 >> 12;
            self.0 ^= self.0 << 25;
            self.0 ^= self.0 >> 27;
            (self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11) as f64 / (1_u64 << 53) as f64
        }
        pub fn between(&mut self, low: f64, high: f64) -> f64 {
            low + (high - low) * self.unit()
        }
        pub fn logarithmic(&mut self, low: f64, high: f64) -> f64 {
            (self.between(low.ln(), high.ln())).exp()
        }
    }
}
