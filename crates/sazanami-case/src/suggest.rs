//! The nearest known word to a misspelt one.

/// The candidate nearest to `word`, if it is near enough to be meant.
#[must_use]
pub fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let lower = word.to_lowercase();
    let limit = (word.chars().count() / 3).max(1);
    candidates
        .into_iter()
        .map(|candidate| (strsim::osa_distance(&lower, &candidate.to_lowercase()), candidate))
        .filter(|&(distance, candidate)| {
            let is_part = lower.len() >= 5 && candidate.contains(&lower);
            let is_start = lower.len() >= 3 && (candidate.starts_with(&lower) || lower.starts_with(candidate));
            distance <= limit || is_part || is_start
        })
        .min_by_key(|&(distance, _)| distance)
        .map(|(_, candidate)| candidate)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_words_are_found_and_far_ones_are_not() {
        let keys = ["density", "kinematic_viscosity", "dynamic_viscosity"];
        assert_eq!(nearest("densty", keys), Some("density"));
        assert_eq!(nearest("Density", keys), Some("density"));
        assert_eq!(nearest("dnesity", keys), Some("density"));
        assert_eq!(nearest("kinematic", keys), Some("kinematic_viscosity"));
        assert_eq!(nearest("viscosit", keys), Some("dynamic_viscosity"));
        assert_eq!(nearest("colour", keys), None);
    }
}
