//! A quadratic program with sparse rows, for clarabel.
//!
//! In: rows `a x <= b` and `a x = b`, a convex quadratic cost. Out: x. Does not know what the numbers are.

use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettingsBuilder, DefaultSolver, IPSolver, NonnegativeConeT, SolverStatus, ZeroConeT};

/// Iterations of the interior-point method; it takes some 10 to 30.
const ITERATIONS_MAX: u32 = 100;

/// A problem.
#[derive(Debug, Default)]
pub(super) struct Problem {
    columns: usize,
    /// Row, column, value.
    entries: (Vec<usize>, Vec<usize>, Vec<f64>),
    right: Vec<f64>,
    equalities: usize,
    /// Row, column, value of the upper triangle of the cost.
    squares: (Vec<usize>, Vec<usize>, Vec<f64>),
    linear: Vec<f64>,
}

impl Problem {
    pub(super) fn new(columns: usize) -> Self {
        Self { columns, linear: vec![0.0; columns], ..Self::default() }
    }

    /// a x = b. All of these come before any of the others.
    pub(super) fn equal(&mut self, row: &[(usize, f64)], right: f64) {
        debug_assert_eq!(self.equalities, self.right.len());
        self.at_most(row, right);
        self.equalities += 1;
    }

    /// a x <= b.
    pub(super) fn at_most(&mut self, row: &[(usize, f64)], right: f64) {
        let index = self.right.len();
        for (column, value) in row.iter().filter(|(_, value)| *value != 0.0) {
            self.entries.0.push(index);
            self.entries.1.push(*column);
            self.entries.2.push(*value);
        }
        self.right.push(right);
    }

    /// Adds `linear a x + square (a x)² / 2` to the cost.
    pub(super) fn cost(&mut self, row: &[(usize, f64)], linear: f64, square: f64) {
        for (i, (column, value)) in row.iter().enumerate() {
            self.linear[*column] += linear * value;
            for (other, factor) in &row[i..] {
                // The lower triangle is not stored.
                self.squares.0.push(*column.min(other));
                self.squares.1.push(*column.max(other));
                self.squares.2.push(square * value * factor);
            }
        }
    }

    /// The least cost, or what the method was left with: the caller looks at it. `None` if it finds none.
    pub(super) fn solve(self) -> Option<Vec<f64>> {
        let rows = self.right.len();
        let cost =
            CscMatrix::new_from_triplets(self.columns, self.columns, self.squares.0, self.squares.1, self.squares.2);
        let matrix = CscMatrix::new_from_triplets(rows, self.columns, self.entries.0, self.entries.1, self.entries.2);
        let cones = [ZeroConeT(self.equalities), NonnegativeConeT(rows - self.equalities)];
        let settings =
            DefaultSettingsBuilder::default().verbose(false).max_iter(ITERATIONS_MAX).max_threads(1).build().ok()?;
        let mut solver = DefaultSolver::new(&cost, &self.linear, &matrix, &self.right, &cones, settings).ok()?;
        solver.solve();
        let useful = matches!(
            solver.solution.status,
            SolverStatus::Solved
                | SolverStatus::AlmostSolved
                | SolverStatus::InsufficientProgress
                | SolverStatus::NumericalError
                | SolverStatus::MaxIterations
        );
        let found = std::mem::take(&mut solver.solution.x);
        (useful && found.iter().all(|x| x.is_finite())).then_some(found)
    }
}
