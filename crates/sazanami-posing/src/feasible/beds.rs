//! Bed files that grains are read from.

use std::ops::Range;
use std::path::Path;

use sazanami_io::bed::{Bed, BedGrain};
use sazanami_numerics::Real;

use crate::bed_shapes::{choose, shapes_of};
use crate::case::meaning::{BedFile, GrainPlacement};
use crate::case::units::rounded;
use crate::case::{Diagnostics, LoadedCase};

/// Reads the beds that populations name; each population is given the grains of its own shape.
///
/// A population alone takes a bed of a single shape whatever it is called. Otherwise the populations take the
/// shapes of their own names, or, where no name is found in the bed and the numbers agree, shape by shape in
/// the order of the case file.
pub(super) fn read(loaded: &LoadedCase, report: &mut Diagnostics) -> Vec<Option<Bed>> {
    let mut beds = vec![None; loaded.case.grains.len()];
    let mut files: Vec<(&BedFile, Vec<usize>)> = Vec::new();
    for (number, population) in loaded.case.grains.iter().enumerate() {
        let GrainPlacement::Bed(bed) = &population.placement else { continue };
        match files.iter_mut().find(|(known, _)| known.file == bed.file) {
            Some((_, users)) => users.push(number),
            None => files.push((bed, vec![number])),
        }
    }
    for (file, users) in files {
        match Bed::read(&file.file) {
            Ok(bed) => deal(loaded, &file.file, &bed, &users, &mut beds, report),
            Err(error) => {
                report
                    .error(span(loaded, users[0]), format!("`{}` is no bed file", file.file.display()))
                    .label(error.to_string())
                    .help(file.how_to_make());
            }
        }
    }
    beds
}

/// Place of the bed file of a population in the case file.
fn span(loaded: &LoadedCase, population: usize) -> Range<usize> {
    loaded.places.at(&format!("grains.{population}.placement.bed.file"))
}

/// Gives each of `users` its grains of a bed.
fn deal(
    loaded: &LoadedCase,
    file: &Path,
    bed: &Bed,
    users: &[usize],
    beds: &mut [Option<Bed>],
    report: &mut Diagnostics,
) {
    let finite = bed.grains.iter().all(|grain| {
        grain.position.is_finite() && (grain.orientation.length() - 1.0).abs() < 1e-6 && grain.scale > 0.0
    });
    if bed.grains.is_empty() || !finite {
        let label = if finite { "it holds no grains" } else { "it holds grains without a place or a size" };
        report.error(span(loaded, users[0]), format!("`{}` is no bed for a run", file.display())).label(label);
        return;
    }
    let (shapes, names) = shapes_of(bed);
    let wanted: Vec<&str> = users.iter().map(|&user| loaded.case.grains[user].name.as_str()).collect();
    let chosen = choose(&names, &wanted);
    let all = names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
    for (&user, choice) in users.iter().zip(&chosen) {
        if choice.is_none() {
            report
                .error(span(loaded, user), format!("the bed has no shape `{}`", loaded.case.grains[user].name))
                .label(format!("its shapes are {all}"))
                .help("give each shape of the bed one population of that `name`");
        }
    }
    if chosen.contains(&None) {
        return;
    }
    for (number, (&shape, name)) in shapes.iter().zip(&names).enumerate() {
        if !chosen.contains(&Some(number)) {
            let left = bed.grains.iter().filter(|grain| grain.shape == shape).count();
            report
                .error(span(loaded, users[0]), format!("no population takes the shape `{name}` of the bed"))
                .label(format!("{left} of its {} grains would be left out", bed.grains.len()))
                .help(format!("add a population with `name = \"{name}\"` and the same `placement.bed`"));
        }
    }
    for (&user, shape) in users.iter().zip(chosen.iter().flatten().map(|&number| shapes[number])) {
        let grains: Vec<_> = bed.grains.iter().filter(|grain| grain.shape == shape).copied().collect();
        count_agrees(loaded, user, grains.len(), report);
        sizes_agree(loaded, user, &grains, report);
        beds[user] = Some(Bed { grains, recipe: bed.recipe.clone(), ..*bed });
    }
}

/// Round-off of size factors.
const ROUNDED: Real = 1e-9;

/// The size factors of a bed have to be within those of `size`, by which smoothing, steps and reach are chosen.
fn sizes_agree(loaded: &LoadedCase, population: usize, grains: &[BedGrain], report: &mut Diagnostics) {
    let kind = &loaded.case.grains[population];
    let sizes = kind.sizes();
    let ends = |factors: [Real; 2], factor: Real| [factors[0].min(factor), factors[1].max(factor)];
    let [smallest, largest] = grains.iter().map(|grain| grain.scale).fold([Real::INFINITY, Real::NEG_INFINITY], ends);
    let fits = smallest >= sizes.smallest() * (1.0 - ROUNDED) && largest <= sizes.largest() * (1.0 + ROUNDED);
    if !fits {
        report
            .error(
                span(loaded, population),
                format!("the bed holds grains of `{}` of other sizes than `size` says", kind.name),
            )
            .label(format!("size factors from {} to {}", rounded(smallest), rounded(largest)))
            .help(format!(
                "write `size.uniform = {{ lower = {}, upper = {} }}`, or the `size` that it was packed with",
                (1e4 * smallest).floor() / 1e4,
                (1e4 * largest).ceil() / 1e4
            ));
    }
}

/// A `count` beside a bed has to be that of the bed.
fn count_agrees(loaded: &LoadedCase, population: usize, found: usize, report: &mut Diagnostics) {
    let kind = &loaded.case.grains[population];
    if let (Some(count), Some(span)) = (kind.count, loaded.places.of(&format!("grains.{population}.count")))
        && count != found
    {
        report
            .error(span, format!("`count` says {count}, the bed holds {found} grains of `{}`", kind.name))
            .label("the bed file gives the number by itself")
            .help("leave out `count`, or name another bed file");
    }
}
