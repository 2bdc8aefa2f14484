//! The nearest known word to a misspelt one.

/// The candidate nearest to `word`, if it is near enough to be meant.
#[must_use]
pub fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let lower = word.to_lowercase();
    let limit = (word.chars().count() / 3).max(1);
    candidates
        .into_iter()
        .map(|candidate| (distance(&lower, &candidate.to_lowercase()), candidate))
        .filter(|&(distance, candidate)| {
            let is_part = lower.len() >= 5 && candidate.contains(&lower);
            let is_start = lower.len() >= 3 && (candidate.starts_with(&lower) || lower.starts_with(candidate));
            distance <= limit || is_part || is_start
        })
        .min_by_key(|&(distance, _)| distance)
        .map(|(_, candidate)| candidate)
}

/// Edit distance with transpositions (restricted Damerau-Levenshtein).
fn distance(a: &str, b: &str) -> usize {
    let (a, b): (Vec<char>, Vec<char>) = (a.chars().collect(), b.chars().collect());
    let width = b.len() + 1;
    let mut table = vec![0; (a.len() + 1) * width];
    for i in 0..=a.len() {
        for j in 0..=b.len() {
            table[i * width + j] = if i == 0 || j == 0 {
                i + j
            } else {
                let change = usize::from(a[i - 1] != b[j - 1]);
                let mut best = (table[(i - 1) * width + j] + 1)
                    .min(table[i * width + j - 1] + 1)
                    .min(table[(i - 1) * width + j - 1] + change);
                if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                    best = best.min(table[(i - 2) * width + j - 2] + 1);
                }
                best
            };
        }
    }
    table[a.len() * width + b.len()]
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
