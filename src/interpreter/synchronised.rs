//! Synchronised actions on $AC_OVR: what the main run is to watch.
//!
//! In: a [`Synchronised`] of the program. Out: an [`Event`] that begins with the next block. What can be watched: $AA_IM, $AC_TIME, $AC_TIMEC, $AC_PATHN, $AC_DTBB, $AC_DTBW,
//! $AC_DTEB, $AC_DTEW, $AC_VACTB and $AC_VACTW, each compared with a value that preparation knows when it reads the block; comparisons joined by AND, OR
//! and NOT. Anything else is reported and not executed. Does not watch: the planner does, which knows every set-point.

use super::evaluate::{evaluate, number};
use super::run::Interpreter;
use super::wire::{Condition, Event, Relation, SynchronisedAction, Watched};
use crate::base::AxisKind;
use crate::base::units::{S_PER_MIN, rad_from_deg, ratio_from_percent};
use crate::machine::TimeLawKind;
use crate::program::syntax::{Binary, Expr, ExprKind, SystemName, Unary};
use crate::program::{Columns, Fault, Outcome, Synchronised, codes, mentions_main_run};
use std::sync::Arc;

/// Highest $AC_OVR.
const HIGHEST_PERCENT: f64 = 200.0;

impl Interpreter {
    /// ID=1 WHENEVER ... DO $AC_OVR=...
    pub(super) fn synchronise(&mut self, action: &Synchronised) -> Outcome<()> {
        let condition = match &action.condition {
            None => Some(Condition::Constant(true)),
            Some(condition) => self.condition(condition)?,
        };
        if self.machine.feed.time_law == TimeLawKind::SevenPhase {
            self.report_action(
                &action.columns,
                "under the time law `seven-phase` the feed cannot change inside a block",
            );
            return Ok(());
        }
        let Some(condition) = condition.filter(|_| !mentions_main_run(&action.override_percent)) else {
            self.report_action(&action.columns, "it asks for values that are not watched");
            return Ok(());
        };
        let percent = number(&action.override_percent, self)?.clamp(0.0, HIGHEST_PERCENT);
        let action = SynchronisedAction {
            id: action.id,
            cadence: action.cadence,
            condition,
            override_ratio: ratio_from_percent(percent),
        };
        self.emit_function(vec![Event::Synchronised(Arc::new(action))], false);
        Ok(())
    }

    /// CANCEL(1, 2).
    pub(super) fn cancel_synchronised(&mut self, numbers: &[Expr]) -> Outcome<()> {
        let ids = super::evaluate::integers(numbers, self)?;
        let ids: Arc<[u32]> = ids.into_iter().filter_map(|id| u32::try_from(id).ok()).collect();
        self.emit_function(vec![Event::CancelSynchronised(ids)], false);
        Ok(())
    }

    /// Reports an action on $AC_OVR that is not executed, each reason once a run.
    fn report_action(&mut self, columns: &Columns, reason: &'static str) {
        if self.first_report(reason) {
            let message = format!("a synchronised action on $AC_OVR is not executed: {reason}");
            let fault = Fault::new(codes::NOT_ACTED_ON, columns.clone(), message).label("known, but not acted on");
            self.warn(*fault.help("docs/feed-and-axes.md says which conditions are watched, and under which time law"));
        }
    }

    /// `None`: something in it cannot be watched.
    fn condition(&self, expression: &Expr) -> Outcome<Option<Condition>> {
        if !mentions_main_run(expression) {
            return Ok(Some(Condition::Constant(evaluate(expression, self)?.truth(&expression.columns)?)));
        }
        Ok(match &expression.kind {
            ExprKind::Unary(Unary::Not, operand) => {
                self.condition(operand)?.map(|condition| Condition::Not(Box::new(condition)))
            }
            ExprKind::Binary(operator @ (Binary::And | Binary::Or), operands) => {
                let both = [self.condition(&operands.0)?, self.condition(&operands.1)?];
                let [Some(left), Some(right)] = both else { return Ok(None) };
                let both = Box::new([left, right]);
                Some(if *operator == Binary::And { Condition::All(both) } else { Condition::Any(both) })
            }
            ExprKind::Binary(operator, operands) => {
                let Some(relation) = relation(*operator) else { return Ok(None) };
                match (self.watched(&operands.0)?, self.watched(&operands.1)?) {
                    (Some(watched), None) => self.comparison(watched, relation, &operands.1)?,
                    (None, Some(watched)) => self.comparison(watched, relation.turned(), &operands.0)?,
                    _ => None,
                }
            }
            _ => None,
        })
    }

    fn comparison(&self, watched: Watched, relation: Relation, value: &Expr) -> Outcome<Option<Condition>> {
        if mentions_main_run(value) {
            return Ok(None);
        }
        let typed = number(value, self)?;
        let value = match watched {
            Watched::Position(axis) if self.machine.axis(axis).kind == AxisKind::Rotary => rad_from_deg(typed),
            Watched::PathVelocity => typed / S_PER_MIN,
            _ => typed,
        };
        Ok(Some(Condition::Compare(watched, relation, value)))
    }

    fn watched(&self, expression: &Expr) -> Outcome<Option<Watched>> {
        let ExprKind::System(SystemName { name, indices }) = &expression.kind else { return Ok(None) };
        let columns: &Columns = &expression.columns;
        Ok(match &**name {
            "$AA_IM" => Some(Watched::Position(self.index_axis(indices, columns)?)),
            "$AC_TIME" => Some(Watched::BlockTime),
            "$AC_TIMEC" => Some(Watched::BlockCycles),
            "$AC_PATHN" => Some(Watched::PathShare),
            "$AC_DTBB" | "$AC_DTBW" => Some(Watched::WayDone),
            "$AC_DTEB" | "$AC_DTEW" => Some(Watched::WayLeft),
            "$AC_VACTB" | "$AC_VACTW" => Some(Watched::PathVelocity),
            _ => None,
        })
    }
}

fn relation(operator: Binary) -> Option<Relation> {
    Some(match operator {
        Binary::Equal => Relation::Equal,
        Binary::Unequal => Relation::Unequal,
        Binary::Less => Relation::Less,
        Binary::LessEqual => Relation::NotGreater,
        Binary::Greater => Relation::Greater,
        Binary::GreaterEqual => Relation::NotLess,
        _ => return None,
    })
}
