//! Names a user may have misspelt: the list of those allowed, the nearest first.
//!
//! Only words; what they name is known elsewhere.

/// Number of letters to insert, delete or replace to get from one word to the other.
fn distance(from: &str, to: &str) -> usize {
    let to: Vec<char> = to.chars().collect();
    let mut row: Vec<usize> = (0..=to.len()).collect();
    for (i, a) in from.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, &b) in to.iter().enumerate() {
            let replaced = diagonal + usize::from(a != b);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[to.len()]
}

/// "one of a, b, c (nearest: b)"; near is at most a third of the letters.
pub(super) fn allowed<S: AsRef<str>>(found: &str, names: &[S]) -> String {
    let list = names.iter().map(AsRef::as_ref).collect::<Vec<_>>().join(", ");
    let nearest = names
        .iter()
        .map(|name| (distance(found, name.as_ref()), name.as_ref()))
        .filter(|&(distance, _)| distance <= (found.chars().count() / 3).max(1))
        .min();
    match nearest {
        Some((_, name)) => format!("one of {list} (did you mean {name}?)"),
        None if names.is_empty() => "nothing: there is none".into(),
        None => format!("one of {list}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distance_counts_single_letters() {
        assert_eq!(distance("kitten", "sitting"), 3);
        assert_eq!(distance("", "abc"), 3);
        assert_eq!(distance("abc", "abc"), 0);
    }

    #[test]
    fn a_near_miss_is_suggested_and_a_far_one_is_not() {
        let names = ["damping_ratio", "frequency_hz"];
        assert!(allowed("dampin_ratio", &names).ends_with("(did you mean damping_ratio?)"));
        assert_eq!(allowed("mass", &names), "one of damping_ratio, frequency_hz");
    }
}
