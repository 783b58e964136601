//! Least squares in blocks of time, with intervals that hold although neighbouring residuals resemble each other.
//!
//! In: rows (regressors, response) in order of time, and where one block of time ends. Out: [`Solution`]: values, and what they become when
//! one block is left out. Each block has its own normal equations, A_b = Σ x xᵀ and c_b = Σ x y, so that leaving one out is one small
//! solution, (A - A_b) θ_b = c - c_b. The variance is that of the delete-a-block jackknife,
//!
//! ```text
//! var θ = (g-1)/g Σ (θ_b - mean)²        half width = t(0.975, ν) sqrt(var)        ν = 1/Σ s_b² - 1
//! ```
//! s_b being the share of block b in what the data know about the parameter: a few blocks that carry all of it give few degrees of
//! freedom. Blocks are longer than the memory of filter and noise. Does not weigh rows and knows nothing of drives.

use nalgebra::{DMatrix, DVector};

/// Normal equations of one block.
#[derive(Clone, Debug)]
struct Block {
    gram: DMatrix<f64>,
    product: DVector<f64>,
    square: f64,
    rows: usize,
}

/// Rows by block.
#[derive(Clone, Debug)]
pub(super) struct Blocks {
    width: usize,
    blocks: Vec<Block>,
    /// Number of the open block.
    open: Option<usize>,
}

/// A solution with what leaving out each block makes of it.
#[derive(Clone, Debug)]
pub(super) struct Solution {
    /// Values in the order of the chosen columns.
    pub(super) theta: DVector<f64>,
    /// Values without one block, for each block.
    pub(super) without: Vec<DVector<f64>>,
    /// Effective number of independent stretches a value rests on.
    pub(super) stretches: Vec<f64>,
    /// Sum of squares of each column that the others do not explain.
    pub(super) own_square: Vec<f64>,
    /// Condition of the columns, each brought to length 1.
    pub(super) condition: f64,
    /// RMS of the residuals.
    pub(super) rms: f64,
}

impl Blocks {
    pub(super) fn new(width: usize) -> Self {
        Self { width, blocks: Vec::new(), open: None }
    }

    /// The next row begins a new block.
    pub(super) fn close(&mut self) {
        self.open = None;
    }

    /// A row of the block `number`; rows of one number that follow each other are one block.
    pub(super) fn push_in(&mut self, number: usize, row: &[f64], response: f64) {
        if self.open != Some(number) {
            self.blocks.push(Block {
                gram: DMatrix::zeros(self.width, self.width),
                product: DVector::zeros(self.width),
                square: 0.0,
                rows: 0,
            });
            self.open = Some(number);
        }
        let Some(block) = self.blocks.last_mut() else { return };
        for (i, left) in row.iter().enumerate().take(self.width) {
            block.product[i] += left * response;
            for (j, right) in row.iter().enumerate().take(i + 1) {
                block.gram[(i, j)] += left * right;
            }
        }
        block.square += response * response;
        block.rows += 1;
    }

    pub(super) fn rows(&self) -> usize {
        self.blocks.iter().map(|block| block.rows).sum()
    }

    /// Least squares on some of the columns; `None` where they do not determine the values.
    pub(super) fn solve(&self, columns: &[usize]) -> Option<Solution> {
        let p = columns.len();
        let picked: Vec<(DMatrix<f64>, DVector<f64>)> = self.blocks.iter().map(|block| pick(block, columns)).collect();
        let mut gram = DMatrix::zeros(p, p);
        let mut product = DVector::zeros(p);
        for (block_gram, block_product) in &picked {
            gram += block_gram;
            product += block_product;
        }
        let rows = self.rows();
        if p == 0 || rows <= p {
            return None;
        }
        // Columns of length 1: their scale is no matter of their condition.
        let scale = DVector::from_fn(p, |i, _| 1.0 / gram[(i, i)].sqrt());
        if !scale.iter().all(|value| value.is_finite()) {
            return None;
        }
        let scaled = DMatrix::from_fn(p, p, |i, j| gram[(i, j)] * scale[i] * scale[j]);
        if !scaled.iter().all(|value| value.is_finite()) {
            return None;
        }
        let eigen = scaled.symmetric_eigenvalues();
        let condition = (eigen.max() / eigen.min().max(0.0)).sqrt();
        if condition.is_nan() || condition >= CONDITION_MAX {
            return None;
        }
        let inverse = scaled.cholesky()?.inverse();
        let inverse = DMatrix::from_fn(p, p, |i, j| inverse[(i, j)] * scale[i] * scale[j]);
        let theta = &inverse * &product;
        let square: f64 = self.blocks.iter().map(|block| block.square).sum();
        let explained = 2.0 * theta.dot(&product) - theta.dot(&(&gram * &theta));
        let rms = ((square - explained).max(0.0) / (rows - p) as f64).sqrt();
        let mut without = Vec::with_capacity(picked.len());
        for (block_gram, block_product) in &picked {
            without.push(solve_scaled(&(&gram - block_gram), &(&product - block_product), &scale)?);
        }
        let stretches = (0..p).map(|j| stretches(&inverse, j, &picked)).collect();
        let own_square = (0..p).map(|j| 1.0 / inverse[(j, j)]).collect();
        Some(Solution { theta, without, stretches, own_square, condition, rms })
    }

    /// Sum of squares of the response.
    pub(super) fn response_square(&self) -> f64 {
        self.blocks.iter().map(|block| block.square).sum()
    }

    /// Sum of squares of the residuals of given values on some columns.
    pub(super) fn residual_square(&self, columns: &[usize], theta: &DVector<f64>) -> f64 {
        self.blocks
            .iter()
            .map(|block| {
                let (gram, product) = pick(block, columns);
                block.square - 2.0 * theta.dot(&product) + theta.dot(&(gram * theta))
            })
            .sum::<f64>()
            .max(0.0)
    }
}

/// Columns of length 1 that are so much alike are not told apart by any trace.
const CONDITION_MAX: f64 = 1e6;

fn pick(block: &Block, columns: &[usize]) -> (DMatrix<f64>, DVector<f64>) {
    // The lower triangle is filled.
    let at = |i: usize, j: usize| if i >= j { block.gram[(i, j)] } else { block.gram[(j, i)] };
    let p = columns.len();
    let gram = DMatrix::from_fn(p, p, |i, j| at(columns[i], columns[j]));
    (gram, DVector::from_fn(p, |i, _| block.product[columns[i]]))
}

fn solve_scaled(gram: &DMatrix<f64>, product: &DVector<f64>, scale: &DVector<f64>) -> Option<DVector<f64>> {
    let p = product.len();
    let scaled = DMatrix::from_fn(p, p, |i, j| gram[(i, j)] * scale[i] * scale[j]);
    let right = DVector::from_fn(p, |i, _| product[i] * scale[i]);
    let solved = scaled.cholesky()?.solve(&right);
    let theta = DVector::from_fn(p, |i, _| solved[i] * scale[i]);
    theta.iter().all(|value| value.is_finite()).then_some(theta)
}

/// 1/Σ s_b² for the part of column `j` that the other columns do not explain.
fn stretches(inverse: &DMatrix<f64>, j: usize, picked: &[(DMatrix<f64>, DVector<f64>)]) -> f64 {
    let column = inverse.column(j) / inverse[(j, j)];
    let parts: Vec<f64> = picked.iter().map(|(gram, _)| column.dot(&(gram * &column)).max(0.0)).collect();
    let total: f64 = parts.iter().sum();
    let squares: f64 = parts.iter().map(|part| (part / total).powi(2)).sum();
    if squares > 0.0 { 1.0 / squares } else { 0.0 }
}

impl Solution {
    /// A function of the values, and the half width of its 95 % interval; `of` names the column whose stretches count.
    pub(super) fn function(&self, of: usize, f: impl Fn(&DVector<f64>) -> f64) -> (f64, f64) {
        let values: Vec<f64> = self.without.iter().map(&f).collect();
        let g = values.len() as f64;
        let mean = values.iter().sum::<f64>() / g;
        let variance = (g - 1.0) / g * values.iter().map(|value| (value - mean).powi(2)).sum::<f64>();
        let freedom = (self.stretches.get(of).copied().unwrap_or(0.0) - 1.0).min(g - 1.0);
        (f(&self.theta), student_t(freedom) * variance.sqrt())
    }

    /// A value and the half width of its 95 % interval.
    pub(super) fn value(&self, j: usize) -> (f64, f64) {
        self.function(j, |theta| theta[j])
    }
}

/// 0.975 quantile of Student's t [Abramowitz 1964, eq. 26.7.5]; for less than two degrees of freedom that of two, times their ratio.
pub(crate) fn student_t(freedom: f64) -> f64 {
    let (z, v) = (1.959_963_985_f64, freedom.max(2.0));
    let terms = [
        (z.powi(3) + z) / 4.0,
        (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / 96.0,
        (3.0 * z.powi(7) + 19.0 * z.powi(5) + 17.0 * z.powi(3) - 15.0 * z) / 384.0,
        (79.0 * z.powi(9) + 776.0 * z.powi(7) + 1482.0 * z.powi(5) - 1920.0 * z.powi(3) - 945.0 * z) / 92160.0,
    ];
    let sum = terms.iter().rev().fold(0.0, |sum, term| (sum + term) / v);
    (z + sum) * (2.0 / freedom.max(0.2)).max(1.0)
}
