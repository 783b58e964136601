//! Sine, logarithm and their kin with the same bits on every machine.
//!
//! In: a number. Out: what the method of the same name of `f64` gives, without the trust in the C library of the system that the latter has: glibc takes
//! other instructions, and gives other last bits, on processors without FMA. All between program and recording uses these (a test of the house sees to it).
//! Arithmetic, `sqrt`, `abs`, `floor`, `powi` and the like are exact or the same everywhere as they are.

/// The methods of `f64` that the system computes, computed by the crate `libm` instead.
#[allow(missing_docs, reason = "each is the method of `f64` of the same name")]
pub trait Portable: Sized {
    fn portable_sin(self) -> Self;
    fn portable_cos(self) -> Self;
    fn portable_sin_cos(self) -> (Self, Self);
    fn portable_tan(self) -> Self;
    fn portable_asin(self) -> Self;
    fn portable_acos(self) -> Self;
    fn portable_atan(self) -> Self;
    fn portable_atan2(self, other: Self) -> Self;
    fn portable_sinh(self) -> Self;
    fn portable_cosh(self) -> Self;
    fn portable_asinh(self) -> Self;
    fn portable_atanh(self) -> Self;
    fn portable_exp(self) -> Self;
    fn portable_ln(self) -> Self;
    fn portable_powf(self, exponent: Self) -> Self;
    fn portable_cbrt(self) -> Self;
    fn portable_hypot(self, other: Self) -> Self;
}

impl Portable for f64 {
    fn portable_sin(self) -> Self {
        libm::sin(self)
    }

    fn portable_cos(self) -> Self {
        libm::cos(self)
    }

    fn portable_sin_cos(self) -> (Self, Self) {
        libm::sincos(self)
    }

    fn portable_tan(self) -> Self {
        libm::tan(self)
    }

    fn portable_asin(self) -> Self {
        libm::asin(self)
    }

    fn portable_acos(self) -> Self {
        libm::acos(self)
    }

    fn portable_atan(self) -> Self {
        libm::atan(self)
    }

    fn portable_atan2(self, other: Self) -> Self {
        libm::atan2(self, other)
    }

    fn portable_sinh(self) -> Self {
        libm::sinh(self)
    }

    fn portable_cosh(self) -> Self {
        libm::cosh(self)
    }

    fn portable_asinh(self) -> Self {
        libm::asinh(self)
    }

    fn portable_atanh(self) -> Self {
        libm::atanh(self)
    }

    fn portable_exp(self) -> Self {
        libm::exp(self)
    }

    fn portable_ln(self) -> Self {
        libm::log(self)
    }

    fn portable_powf(self, exponent: Self) -> Self {
        libm::pow(self, exponent)
    }

    fn portable_cbrt(self) -> Self {
        libm::cbrt(self)
    }

    fn portable_hypot(self, other: Self) -> Self {
        libm::hypot(self, other)
    }
}
