//! `[output]`: what is written when.

use std::path::PathBuf;

use sazanami_case_derive::Keys;
use sazanami_numerics::choices;

use super::{GrainPlacement, Schedule};
use crate::read::{Context, Table};

choices! {
    /// Precision of written fields.
    #[derive(Default)]
    pub enum FieldPrecision {
        /// Four bytes a number.
        #[default]
        Single = "single",
        /// Eight bytes a number.
        Double = "double",
    }

    /// Frame that positions and velocities are written in.
    #[derive(Default)]
    pub enum OutputFrame {
        /// That of the tank.
        #[default]
        Tank = "tank",
        /// That of the laboratory.
        Laboratory = "laboratory",
    }
}

/// What is written when.
#[derive(Clone, Debug, Default, PartialEq, Keys)]
#[keys(check = Self::check)]
pub struct Outputs {
    /// Precision of fields.
    #[key(word, default = FieldPrecision::Single)]
    pub precision: FieldPrecision,
    /// Where the tank moves: frame of positions and velocities in `fields`, `grains` and probes. Series, `bed.csv`,
    /// `water.csv`, `layers.csv` and pictures are always those in the tank; so are the places of `point`, `line` and
    /// `gauge` probes, and water levels.
    #[key(word, default = OutputFrame::Tank)]
    pub frame: OutputFrame,
    /// File that the packed bed is written to, beside `packed.bed` in the folder of results; relative to the case file.
    pub bed: Option<PathBuf>,
    /// Fields for ParaView.
    #[key(table, default = Schedule::ends(cx.known.run.until), says = "at the start and at the end")]
    pub fields: Schedule,
    /// Grains for ParaView.
    #[key(table, default = Schedule::ends(cx.known.run.until), says = "at the start and at the end")]
    pub grains: Schedule,
    /// Pictures.
    #[key(table, default = Schedule::ends(cx.known.run.until), says = "at the start and at the end")]
    pub figures: Schedule,
    /// Rows of series.csv.
    #[key(table, default = Schedule::each_step(), says = "every step")]
    pub series: Schedule,
}

impl Outputs {
    fn check(&mut self, table: &Table<'_>, cx: &mut Context<'_>) {
        let packs = cx.known.grains.iter().any(|p| matches!(p.placement, GrainPlacement::Packed(_)));
        if self.bed.is_some() && !packs && !cx.known.is_damaged {
            cx.report
                .error(table.place("bed"), "no bed is packed in this run")
                .label("`output.bed` writes the bed that `placement.packed` makes");
        }
    }
}
