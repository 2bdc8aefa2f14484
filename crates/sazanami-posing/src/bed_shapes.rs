//! Which shape of a bed file each population takes.

use sazanami_io::bed::Bed;
use sazanami_numerics::Real;

use crate::case::meaning::{Case, GrainPlacement, Population};

/// Numbers and names of the shapes of a bed.
pub(crate) fn shapes_of(bed: &Bed) -> (Vec<u32>, Vec<String>) {
    let mut shapes: Vec<u32> = bed.grains.iter().map(|grain| grain.shape).collect();
    shapes.sort_unstable();
    shapes.dedup();
    let named = |shape: u32| bed.recipe.shapes.get(shape as usize).cloned().unwrap_or(format!("shape {shape}"));
    let names = shapes.iter().map(|&shape| named(shape)).collect();
    (shapes, names)
}

/// Size factors of the grains that a population has in its bed file; `None` where it has none, or the file is not there.
pub(crate) fn factors_in_bed(case: &Case, population: usize) -> Option<Vec<Real>> {
    let file_of = |population: &Population| match &population.placement {
        GrainPlacement::Bed(bed) => Some(bed.file.clone()),
        _ => None,
    };
    let file = file_of(&case.grains[population])?;
    let bed = Bed::read(&file).ok()?;
    let (shapes, names) = shapes_of(&bed);
    let users = case.grains.iter().enumerate().filter(|(_, user)| file_of(user).as_ref() == Some(&file));
    let (users, wanted): (Vec<usize>, Vec<&str>) = users.map(|(n, user)| (n, user.name.as_str())).unzip();
    let number = users.iter().position(|&user| user == population)?;
    let shape = shapes[choose(&names, &wanted)[number]?];
    Some(bed.grains.iter().filter(|grain| grain.shape == shape).map(|grain| grain.scale).collect())
}

/// Index among the shapes called `names` of the one that each of the populations called `wanted` takes.
pub(crate) fn choose(names: &[String], wanted: &[&str]) -> Vec<Option<usize>> {
    if let ([_], [_]) = (names, wanted) {
        return vec![Some(0)];
    }
    let by_name: Vec<_> = wanted.iter().map(|&name| names.iter().position(|known| known == name)).collect();
    if names.len() == wanted.len() && by_name.iter().all(Option::is_none) {
        return (0..names.len()).map(Some).collect();
    }
    by_name
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shapes_go_to_populations_by_name_and_else_by_number() {
        let names = |list: &[&str]| list.iter().map(|&name| name.to_owned()).collect::<Vec<_>>();
        assert_eq!(choose(&names(&["sand"]), &["grit"]), [Some(0)]);
        assert_eq!(choose(&names(&["sand", "grit"]), &["grit", "sand"]), [Some(1), Some(0)]);
        assert_eq!(choose(&names(&["sand", "grit"]), &["a", "b"]), [Some(0), Some(1)]);
        assert_eq!(choose(&names(&["sand", "grit"]), &["sand", "b"]), [Some(0), None]);
        assert_eq!(choose(&names(&["sand", "grit"]), &["sand"]), [Some(0)]);
        assert_eq!(choose(&names(&["sand", "grit"]), &["a"]), [None]);
        assert_eq!(choose(&names(&["sand"]), &["a", "b"]), [None, None]);
    }
}
