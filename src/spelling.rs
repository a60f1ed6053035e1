//! Spelling: the allowed word that a misspelt one was most likely meant to be.
//!
//! It suggests; whether a word is allowed is decided elsewhere.

/// Number of insertions, deletions, substitutions and swaps of neighbours that turn `a` into `b`
/// (optimal string alignment distance).
fn distance(a: &str, b: &str) -> usize {
    let (a, b): (Vec<char>, Vec<char>) = (a.chars().collect(), b.chars().collect());
    let mut rows = vec![(0..=b.len()).collect::<Vec<usize>>()];
    for i in 1..=a.len() {
        let mut row = vec![i];
        for j in 1..=b.len() {
            let substitution = rows[i - 1][j - 1] + usize::from(a[i - 1] != b[j - 1]);
            let mut least = substitution.min(rows[i - 1][j] + 1).min(row[j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                least = least.min(rows[i - 2][j - 2] + 1);
            }
            row.push(least);
        }
        rows.push(row);
    }
    rows[a.len()][b.len()]
}

/// The candidate nearest to `word`, if fewer than two fifths of the letters differ.
pub fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    candidates
        .into_iter()
        .map(|candidate| (distance(word, candidate), candidate))
        .filter(|(d, candidate)| {
            5 * d < 2 * word.chars().count().max(candidate.chars().count()) && *d > 0
        })
        .min_by_key(|(d, _)| *d)
        .map(|(_, candidate)| candidate)
}

/// What is allowed instead of `word`: the nearest candidate and the list, which is cut where it
/// is long.
pub fn allowed_instead<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> String {
    const SHOWN: usize = 12;
    let candidates: Vec<&str> = candidates.into_iter().collect();
    let mut list = candidates.iter().take(SHOWN).copied().collect::<Vec<_>>().join(", ");
    if candidates.is_empty() {
        list = "nothing (none exists)".into();
    } else if candidates.len() > SHOWN {
        list += &format!(", … ({} in all)", candidates.len());
    }
    match nearest(word, candidates) {
        Some(candidate) => format!("did you mean `{candidate}`? One of: {list}"),
        None => list,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_count_single_edits_and_swaps() {
        assert_eq!(distance("mass_kg", "mass_kg"), 0);
        assert_eq!(distance("mas_kg", "mass_kg"), 1);
        assert_eq!(distance("msas_kg", "mass_kg"), 1);
        assert_eq!(distance("kitten", "sitting"), 3);
        assert_eq!(distance("", "abc"), 3);
    }

    #[test]
    fn a_misspelt_word_finds_its_neighbour_and_a_strange_one_finds_none() {
        let keys = ["mass_kg", "cg_m", "length_m"];
        assert_eq!(nearest("mas_kg", keys), Some("mass_kg"));
        assert_eq!(nearest("lenght_m", keys), Some("length_m"));
        assert_eq!(nearest("colour", keys), None);
    }
}
