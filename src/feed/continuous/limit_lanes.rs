//! Limits of the interior-point method, four side by side, one array a number, so that the processor takes them in one instruction.
//!
//! In: limits `a . (x, u) <= bound`, states and steps of their node. Out: slacks, multipliers and their steps, and the sums over limits that the
//! recursion along the chain needs. A lane without a limit is `0 <= 1` with a multiplier that stays 0: it adds nothing to any sum. The lanes are
//! summed in one order whatever the processor.
//! Does not know chains.

/// Limits side by side.
pub(super) const LANES: usize = 4;

/// One number of each.
pub(super) type Lanes = [f64; LANES];

/// Four limits with their slacks and multipliers.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub(super) struct Block {
    a: [Lanes; 3],
    bound: Lanes,
    slack: Lanes,
    multiplier: Lanes,
    /// 1/(slack multiplier) at the present point; of a lane without a limit 0.
    inverse: Lanes,
    residual: Lanes,
    slack_step: Lanes,
    multiplier_step: Lanes,
}

impl Default for Block {
    fn default() -> Self {
        let none = [0.0; LANES];
        Self {
            a: [none; 3],
            bound: [1.0; LANES],
            slack: none,
            multiplier: none,
            inverse: none,
            residual: none,
            slack_step: none,
            multiplier_step: none,
        }
    }
}

/// Force and Hessian of the limits of a node, by lanes.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sums {
    force: [Lanes; 3],
    /// 00, 01, 11, 0u, 1u, uu.
    hessian: [Lanes; 6],
}

/// How far the affine direction leads, and the products of slacks and multipliers on the way.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Prediction {
    /// Reciprocals of the steps at which the first slack and the first multiplier would vanish.
    primal: Lanes,
    dual: Lanes,
    /// Sums of multiplier times slack step, slack times multiplier step, and of both steps.
    by_slack: Lanes,
    by_multiplier: Lanes,
    by_both: Lanes,
}

impl Sums {
    #[inline(always)]
    pub fn force(&self) -> [f64; 3] {
        self.force.each_ref().map(sum)
    }

    #[inline(always)]
    pub fn hessian(&self) -> [f64; 6] {
        self.hessian.each_ref().map(sum)
    }
}

impl Prediction {
    /// The gap at the end of the longest step.
    pub fn gap_after(&self, gap_ratio: f64) -> f64 {
        let [primal, dual] = [&self.primal, &self.dual].map(|lanes| 1.0 / lanes.iter().copied().fold(1.0, greater));
        let [by_slack, by_multiplier, by_both] = [&self.by_slack, &self.by_multiplier, &self.by_both].map(sum);
        gap_ratio + primal * by_slack + dual * by_multiplier + primal * dual * by_both
    }
}

impl Block {
    /// A limit in a lane.
    pub fn set(&mut self, lane: usize, a_ratio: [f64; 3], bound_ratio: f64) {
        for (lanes, a) in self.a.iter_mut().zip(a_ratio) {
            lanes[lane] = a;
        }
        self.bound[lane] = bound_ratio;
        self.multiplier[lane] = 1.0;
    }

    /// The control is this feedback of the state.
    pub fn put_control(&mut self, feedback_ratio: [f64; 2]) {
        for lane in 0..LANES {
            let control = std::mem::take(&mut self.a[2][lane]);
            self.a[0][lane] += control * feedback_ratio[0];
            self.a[1][lane] += control * feedback_ratio[1];
        }
    }

    /// The limit of a lane is so much wider.
    pub fn loosen(&mut self, lane: usize, by_ratio: f64) {
        self.bound[lane] += by_ratio * self.bound[lane].abs().min(1.0);
    }

    /// Factor of the control, slack and multiplier of a lane.
    pub fn held(&self, lane: usize) -> (f64, f64, f64) {
        (self.a[2][lane], self.slack[lane], self.multiplier[lane])
    }

    /// Slacks at a point, `slack_min` at least, and multipliers of equal products with them.
    pub fn begin(&mut self, state_ratio: &[f64; 2], control_ratio: f64, slack_min_ratio: f64, product_ratio: f64) {
        for lane in 0..LANES {
            let along =
                self.a[0][lane] * state_ratio[0] + self.a[1][lane] * state_ratio[1] + self.a[2][lane] * control_ratio;
            self.slack[lane] = (self.bound[lane] - along).max(slack_min_ratio);
            self.multiplier[lane] *= product_ratio / self.slack[lane];
        }
    }

    /// Goes a step; then the products of slacks and multipliers, added to `total`, the greatest residuals, and what the limits add to force and
    /// Hessian of their node.
    #[inline(always)]
    pub fn advance(
        &mut self,
        step_ratio: f64,
        state_ratio: &[f64; 2],
        control_ratio: f64,
        sums: &mut Sums,
        total: &mut Lanes,
        residual: &mut Lanes,
    ) {
        let [a0, a1, a2] = &self.a;
        let Sums { force: [f0, f1, f2], hessian: [h00, h01, h11, h0u, h1u, huu] } = sums;
        for l in 0..LANES {
            let slack = self.slack[l] + step_ratio * self.slack_step[l];
            let multiplier = self.multiplier[l] + step_ratio * self.multiplier_step[l];
            let missing =
                self.bound[l] - (a0[l] * state_ratio[0] + a1[l] * state_ratio[1] + a2[l] * control_ratio) - slack;
            residual[l] = greater(residual[l], missing.abs());
            let product = slack * multiplier;
            total[l] += product;
            // Of a lane without a limit the product is 0.
            let inverse = if product > 0.0 { 1.0 / product } else { 0.0 };
            let slack_inverse = multiplier * inverse;
            let weight = multiplier * slack_inverse;
            let pull = -weight * missing;
            f0[l] += pull * a0[l];
            f1[l] += pull * a1[l];
            f2[l] += pull * a2[l];
            let (w0, w1) = (weight * a0[l], weight * a1[l]);
            h00[l] += w0 * a0[l];
            h01[l] += w0 * a1[l];
            h11[l] += w1 * a1[l];
            h0u[l] += w0 * a2[l];
            h1u[l] += w1 * a2[l];
            huu[l] += weight * a2[l] * a2[l];
            self.slack[l] = slack;
            self.multiplier[l] = multiplier;
            self.residual[l] = missing;
            self.inverse[l] = inverse;
        }
    }

    /// The affine direction: how far it leads, what centring adds to the force, and what the correction of second order does.
    #[inline(always)]
    pub fn predict(
        &mut self,
        state_step_ratio: &[f64; 2],
        control_step_ratio: f64,
        prediction: &mut Prediction,
        inward: &mut [Lanes; 3],
        correction: &mut [Lanes; 3],
    ) {
        let Prediction { primal, dual, by_slack, by_multiplier, by_both } = prediction;
        let ([i0, i1, i2], [c0, c1, c2]) = (inward, correction);
        let [a0, a1, a2] = &self.a;
        for l in 0..LANES {
            let along = a0[l] * state_step_ratio[0] + a1[l] * state_step_ratio[1] + a2[l] * control_step_ratio;
            let slack_step = self.residual[l] - along;
            let inverse = self.multiplier[l] * self.inverse[l];
            let share = slack_step * inverse;
            let multiplier_step = -self.multiplier[l] - self.multiplier[l] * share;
            primal[l] = greater(primal[l], -share);
            // Here the multiplier's step is -multiplier - weight * slack step.
            dual[l] = greater(dual[l], 1.0 + share);
            let both = slack_step * multiplier_step;
            by_slack[l] += self.multiplier[l] * slack_step;
            by_multiplier[l] += self.slack[l] * multiplier_step;
            by_both[l] += both;
            let second = both * inverse;
            i0[l] += inverse * a0[l];
            i1[l] += inverse * a1[l];
            i2[l] += inverse * a2[l];
            c0[l] += second * a0[l];
            c1[l] += second * a1[l];
            c2[l] += second * a2[l];
        }
    }

    /// The corrected direction. `primal`, `dual`: reciprocals of the steps at which the first slack and the first multiplier would vanish.
    #[inline(always)]
    pub fn correct(
        &mut self,
        affine_ratio: &[f64; 3],
        step_ratio: &[f64; 3],
        centring_ratio: f64,
        primal: &mut Lanes,
        dual: &mut Lanes,
    ) {
        let [a0, a1, a2] = &self.a;
        let along = |step: &[f64; 3]| each(|l| a0[l] * step[0] + a1[l] * step[1] + a2[l] * step[2]);
        let (predicted, reached) = (along(affine_ratio), along(step_ratio));
        let inverse = each(|l| self.multiplier[l] * self.inverse[l]);
        let predicted = each(|l| self.residual[l] - predicted[l]);
        let correction =
            each(|l| predicted[l] * (self.multiplier[l] + self.multiplier[l] * (predicted[l] * inverse[l])));
        let slack_step = each(|l| self.residual[l] - reached[l]);
        let share = each(|l| slack_step[l] * inverse[l]);
        let multiplier_step = each(|l| {
            (centring_ratio + correction[l]) * inverse[l] - (self.multiplier[l] + self.multiplier[l] * share[l])
        });
        *primal = each(|l| greater(primal[l], -share[l]));
        let dual_share = each(|l| multiplier_step[l] * (self.slack[l] * self.inverse[l]));
        *dual = each(|l| greater(dual[l], -dual_share[l]));
        (self.slack_step, self.multiplier_step) = (slack_step, multiplier_step);
    }
}

#[inline(always)]
fn each(lane: impl Fn(usize) -> f64) -> Lanes {
    [lane(0), lane(1), lane(2), lane(3)]
}

/// In one order, whatever the processor.
#[inline(always)]
pub(super) fn sum(lanes: &Lanes) -> f64 {
    (lanes[0] + lanes[1]) + (lanes[2] + lanes[3])
}

/// The greater of two numbers in one instruction: `f64::max` also looks for NaN, which the gap shows anyway.
#[inline(always)]
pub(super) fn greater(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}
