//! `[coupling]`: how fluid and resolved grains act on each other.

use sazanami_case_derive::keys_of;
pub use sazanami_mics::grains::Coupling;
use sazanami_mics::grains::Exchange;
use sazanami_numerics::geometry::VolumeFractionMethod;
use serde_json::json;
use toml::de::DeValue;

use crate::key::{KeyDoc, ValueDoc};
use crate::read::{At, Context};
use crate::removed::instead_of;
use crate::value::{Range1, Value, split_call};
use crate::write::{Paths, Written};

/// Fluid and resolved grains.
#[keys_of(Coupling)]
struct Coupling {
    /// Exchange of momentum between fluid and grains; see docs/guide/exchange.md.
    #[key(word, default, paper_literal = (Yagyu, Exchange::Stress,
          "forces on grains are the stress integral; what back-projection takes is lost"))]
    exchange: Exchange,
    /// Evaluator of covered volumes: `columns(n)` (n x n columns a cell, exact along x3) or `clip` (exact clipping of
    /// tetrahedra, slow); n from 1 to 64.
    #[key(name = "alpha", default)]
    volume_fraction: VolumeFractionMethod,
    #[key(skip = cx.known.dem.substeps)]
    substeps: sazanami_dem::Substeps,
}

impl Value for VolumeFractionMethod {
    fn doc() -> ValueDoc {
        ValueDoc::Leaf("word", |_| json!({ "type": "string", "pattern": "^(columns\\([0-9]+\\)|clip)$" }))
    }

    fn read(at: &At<'_>, key: &KeyDoc, _: Range1, cx: &mut Context<'_>) -> Option<Self> {
        const EXPECTED: &str = "expected \"columns(4)\" or \"clip\"";
        let call = match at.value {
            Some(DeValue::String(text)) => split_call(text),
            _ => None,
        };
        match call {
            Some(("columns", Some(n @ 1..=64))) => return Some(Self::Columns { per_axis: n as u8 }),
            Some(("clip", None)) => return Some(Self::Clip),
            Some((name, _)) if let Some(instead) = instead_of(&at.path, Some(name)) => {
                cx.removed("choice", name, at.span.clone(), instead);
            }
            Some(_) => {
                cx.report
                    .error(at.span.clone(), "no such evaluator of volume fractions")
                    .label(EXPECTED)
                    .help("the count is per cell edge, 1 to 64");
            }
            None => {
                cx.report.error(at.span.clone(), format!("`{}` cannot be read", key.name)).label(EXPECTED);
            }
        }
        None
    }

    fn write(&self, _: &str, _: Paths) -> Written {
        Written::Leaf(match self {
            Self::Columns { per_axis } => format!("\"columns({per_axis})\""),
            Self::Clip => "\"clip\"".into(),
        })
    }

    fn blank() -> Self {
        Self::Clip
    }

    fn example(_: &KeyDoc) -> String {
        "\"columns(4)\"".into()
    }
}
