//! Mound and ripples of a bed, and what published formulas expect.

use sazanami_numerics::Real;
use sazanami_observe::ripples::{BedFormSettings, BedForms, SurfaceProfile, TankInside};
use serde_json::{Map, Value, json};

use super::closed;
use crate::case::meaning::{self, Case};
use crate::check::{BedReport, bed_flow};

/// Settings that tell mound and ripples of a case apart; `None` if it observes none.
pub(crate) fn form_settings(case: &Case) -> Option<BedFormSettings> {
    let how = case.ripples.as_ref()?;
    Some(bed_flow(case).map_or_else(|| BedFormSettings::of_grains(how.grain_size), |flow| flow.forms()))
}

/// Mound and ripples on the main surface of a bed.
pub(crate) fn forms_of(
    how: &meaning::Ripples,
    tank: &TankInside,
    profile: &SurfaceProfile,
    settings: &BedFormSettings,
) -> BedForms {
    BedForms::of(&closed(how, tank, profile), tank.reach(how.margin), settings)
}

/// The surface of a bed with its `relief` \[m], and the flow over it, in the form of the summary; lengths in mm.
pub(crate) fn surface_json(
    bed: &SurfaceProfile,
    relief: Option<Real>,
    forms: &BedForms,
    flow: Option<&BedReport>,
    tank: &TankInside,
) -> Map<String, Value> {
    let mut found = forms_json(forms);
    found.insert("relief_mm".into(), json!(relief.map(|relief| 1e3 * relief)));
    found.insert("mean_height_mm".into(), json!(bed.mean().map(|z| 1e3 * (z - tank.floor))));
    found.extend(flow.map(|flow| ("flow".to_owned(), flow_json(flow))));
    found
}

/// Mound and ripples in the form of the summary; lengths in mm. Where there are none it says why.
fn forms_json(forms: &BedForms) -> Map<String, Value> {
    let mm = |metres: Real| 1e3 * metres;
    let mound = forms.mound.map_or_else(
        |problem| json!({ "none": problem.to_string() }),
        |mound| {
            json!({
                "wavelength_mm": mm(mound.wavelength),
                "height_mm": mm(mound.height),
                "crest_mm": mm(mound.crest),
            })
        },
    );
    let crested = forms.ripples.as_ref().map_or_else(
        |problem| json!({ "none": problem.to_string() }),
        |ripples| {
            json!({
                "wavelength_mm": mm(ripples.wavelength),
                "wavelength_uncertainty_mm": ripples.uncertainty.map(mm),
                "height_mm": mm(ripples.height),
                "crests_mm": ripples.crests.iter().map(|x| mm(*x)).collect::<Vec<_>>(),
            })
        },
    );
    [("mound".to_owned(), mound), ("crested".to_owned(), crested)].into_iter().collect()
}

/// The flow over a bed and the ripples that formulas give for it, in the form of the summary; lengths in mm.
fn flow_json(flow: &BedReport) -> Value {
    let mm = |metres: Real| 1e3 * metres;
    let predicted: Vec<Value> = flow
        .predicted
        .iter()
        .map(|one| {
            json!({
                "source": one.source,
                "wavelength_mm": mm(one.wavelength_m),
                "height_mm": one.height_m.map(mm),
            })
        })
        .collect();
    json!({
        "orbital_speed_m_per_s": flow.orbital_speed,
        "orbital_amplitude_mm": mm(flow.orbital_amplitude_m),
        "mobility": flow.mobility,
        "least_mobility": flow.least_mobility,
        "mobile_mm": flow.mobile_m.iter().map(|part| part.map(mm)).collect::<Vec<_>>(),
        "predicted": predicted,
    })
}
