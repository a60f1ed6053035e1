//! Patterns: dotted names in which `*` stands for any text within one segment.
//!
//! What is named is not known here.

/// Whether `pattern` matches `name`; each `*` stands for any text without a dot.
pub fn matches(pattern: &str, name: &str) -> bool {
    let (pattern, name) = (pattern.split('.'), name.split('.'));
    pattern.clone().count() == name.clone().count()
        && pattern.zip(name).all(|(pattern, name)| segment(pattern, name))
}

/// Whether a segment matches: the pieces between stars occur in turn, the first at the start and
/// the last at the end.
fn segment(pattern: &str, name: &str) -> bool {
    let Some((first, rest)) = pattern.split_once('*') else { return pattern == name };
    let (middle, last) = rest.rsplit_once('*').unwrap_or(("", rest));
    let Some(mut left) = name.strip_prefix(first).and_then(|n| n.strip_suffix(last)) else {
        return false;
    };
    middle.split('*').all(|piece| match left.find(piece) {
        Some(at) => {
            left = &left[at + piece.len()..];
            true
        }
        None => false,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_star_stays_inside_its_segment() {
        assert!(matches("booster.left.case.*", "booster.left.case.01"));
        assert!(!matches("booster.left.case.*", "booster.left.case.01.a"));
        assert!(!matches("booster.*", "booster.left.case"));
        assert!(matches("booster.*", "booster.left"));
        assert!(matches("*.*", "core.1"));
        assert!(!matches("*", "core.1"));
    }

    #[test]
    fn pieces_between_stars_occur_in_turn() {
        assert!(matches("a*b*c", "axxbyyc") && matches("a*b*c", "abc"));
        assert!(!matches("a*b*c", "acb") && !matches("ab*ba", "aba"));
        assert!(matches("m0*", "m012") && !matches("m0*", "m112"));
        assert!(matches("exact", "exact") && !matches("exact", "exactly"));
    }

    proptest::proptest! {
        #[test]
        fn a_name_with_parts_replaced_by_stars_matches_it(name in "[a-z]{0,4}(\\.[a-z]{1,4}){0,3}", cut in 0_usize..12) {
            let cut = cut.min(name.len());
            let dot = name[cut..].find('.').map_or(name.len(), |i| cut + i);
            let pattern = format!("{}*{}", &name[..cut], &name[dot..]);
            proptest::prop_assert!(matches(&pattern, &name));
        }
    }
}
