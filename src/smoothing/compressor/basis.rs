//! B-splines of degree 5 over any knots, and the banded systems that they make.
//!
//! In: knots. Out: the six basis polynomials of a span, what bending them costs, the solution of banded equations. Does not know
//! points or tolerances: that is `spline`.

use crate::base::AxisVector;

/// Coefficients, constant first, over x from 0 to 1.
pub(super) type Coefficients = [f64; 6];

/// The basis polynomials of a span, in the order of their coefficients.
pub(super) type Basis = [Coefficients; 6];

/// Knots that say what the basis is on the span between the middle two of them.
pub(super) const KNOTS: usize = 12;

/// Pivots below this share of their diagonal are 0.
const PIVOT_MIN_RATIO: f64 = 1e-14;

/// The basis on the span from `knots[5]` to `knots[6]`, by the recursion of Cox and de Boor on polynomials.
pub(super) fn basis(knots: &[f64; KNOTS]) -> Basis {
    let (start, width) = (knots[5], knots[6] - knots[5]);
    let mut rows: Basis = [[0.0; 6]; 6];
    rows[0][0] = 1.0;
    for degree in 1..=5 {
        let before = rows;
        rows = [[0.0; 6]; 6];
        for r in 0..=degree {
            let i = 5 - degree + r;
            if r > 0 {
                // Rises from knot i to knot i + degree.
                let rise = knots[i + degree] - knots[i];
                add_product(&mut rows[r], &before[r - 1], [(start - knots[i]) / rise, width / rise]);
            }
            if r < degree {
                // Falls from knot i + 1 to knot i + degree + 1.
                let fall = knots[i + degree + 1] - knots[i + 1];
                add_product(&mut rows[r], &before[r], [(knots[i + degree + 1] - start) / fall, -width / fall]);
            }
        }
    }
    rows
}

/// Adds the product of a polynomial and a linear factor.
fn add_product(sum: &mut Coefficients, polynomial: &Coefficients, [constant, slope]: [f64; 2]) {
    for k in 0..6 {
        sum[k] += constant * polynomial[k];
        if k > 0 {
            sum[k] += slope * polynomial[k - 1];
        }
    }
}

/// Values of the six basis polynomials at x.
pub(super) fn values(basis: &Basis, x: f64) -> Coefficients {
    basis.each_ref().map(|c| c[0] + x * (c[1] + x * (c[2] + x * (c[3] + x * (c[4] + x * c[5])))))
}

/// Integrals over the span of the products of third derivatives, for a span of width 1.
pub(super) fn bending(basis: &Basis) -> [Coefficients; 6] {
    let third = basis.each_ref().map(|c| [6.0 * c[3], 24.0 * c[4], 60.0 * c[5]]);
    third.map(|a| {
        third.map(|b| {
            a[0] * b[0]
                + (a[0] * b[1] + a[1] * b[0]) / 2.0
                + (a[0] * b[2] + a[1] * b[1] + a[2] * b[0]) / 3.0
                + (a[1] * b[2] + a[2] * b[1]) / 4.0
                + a[2] * b[2] / 5.0
        })
    })
}

/// A symmetric matrix with five diagonals on either side: row i holds its entries in columns i, i - 1 .. i - 5.
#[derive(Clone, Debug, Default)]
pub(super) struct Banded {
    rows: Vec<[f64; 6]>,
}

impl Banded {
    pub(super) fn zero(size: usize) -> Self {
        Self { rows: vec![[0.0; 6]; size] }
    }

    /// Adds `factor` times the products of a span whose first coefficient is `first`.
    pub(super) fn add(&mut self, first: usize, products: &[Coefficients; 6], factor: f64) {
        for (i, row) in products.iter().enumerate() {
            for (j, product) in row.iter().enumerate().take(i + 1) {
                self.rows[first + i][i - j] += factor * product;
            }
        }
    }

    /// Takes an unknown out of the equations: its value is known.
    pub(super) fn fix(&mut self, index: usize, value: &AxisVector, right: &mut [AxisVector]) {
        for back in 1..=5.min(index) {
            let factor = std::mem::take(&mut self.rows[index][back]);
            right[index - back] += *value * -factor;
        }
        for ahead in 1..6 {
            let Some(row) = self.rows.get_mut(index + ahead) else { break };
            let factor = std::mem::take(&mut row[ahead]);
            right[index + ahead] += *value * -factor;
        }
        self.rows[index] = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        right[index] = *value;
    }

    /// Solves in place. `None`: singular to rounding.
    pub(super) fn solve(mut self, right: &mut [AxisVector]) -> Option<()> {
        for i in 0..self.rows.len() {
            let reach = i.min(5);
            let diagonal = self.rows[i][0];
            let mut row = self.rows[i];
            // L D of this row, then L.
            for back in (1..=reach).rev() {
                let column = self.rows[i - back];
                for further in back + 1..=reach {
                    row[back] -= row[further] * column[further - back];
                }
            }
            let mut pivot = diagonal;
            for (back, scaled) in row.iter_mut().enumerate().take(reach + 1).skip(1) {
                let factor = *scaled / self.rows[i - back][0];
                pivot -= factor * *scaled;
                *scaled = factor;
            }
            let positive = pivot > PIVOT_MIN_RATIO * diagonal;
            if !positive {
                return None;
            }
            row[0] = pivot;
            self.rows[i] = row;
            for back in 1..=reach {
                let before = right[i - back];
                right[i] += before * -row[back];
            }
        }
        for i in (0..self.rows.len()).rev() {
            right[i] = right[i] * (1.0 / self.rows[i][0]);
            for ahead in 1..6 {
                let Some(row) = self.rows.get(i + ahead) else { break };
                let after = right[i + ahead];
                right[i] += after * -row[ahead];
            }
        }
        Some(())
    }
}
