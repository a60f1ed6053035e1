//! Two-level factorials: which bits of the case index set a factor, full or fractional.

/// The bits of the case index whose parity sets each of `count` factors of a two-level factorial, so
/// that no `resolution` − 1 of them or fewer have an even number of every bit: no effect of r factors is
/// confounded with one of fewer than `resolution` − r. Without a resolution the full factorial.
///
/// Each generator is the least number that is no exclusive or of `resolution` − 2 earlier ones or fewer
/// (a lexicode); for resolutions 3 to 5.
pub fn generators(count: usize, resolution: Option<usize>) -> Vec<u64> {
    let Some(resolution) = resolution else { return (0..count).map(|i| 1 << i).collect() };
    // Exclusive ors of exactly 0, 1, … resolution − 2 generators, and which numbers they cover.
    let mut sums: Vec<Vec<u64>> = vec![Vec::new(); resolution - 1];
    sums[0].push(0);
    let mut covered = vec![true];
    let mut generators = Vec::new();
    let mut next = 1_u64;
    while generators.len() < count {
        if covered.get(next as usize).copied().unwrap_or(false) {
            next += 1;
            continue;
        }
        generators.push(next);
        for terms in (1..sums.len()).rev() {
            let more: Vec<u64> = sums[terms - 1].iter().map(|sum| sum ^ next).collect();
            for &sum in &more {
                if covered.len() <= sum as usize {
                    covered.resize(sum as usize + 1, false);
                }
                covered[sum as usize] = true;
            }
            sums[terms].extend(more);
        }
    }
    generators
}
