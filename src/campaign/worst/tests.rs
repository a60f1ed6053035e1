//! What a worst case says of itself; searches are tested on the reference vehicle, from outside.

use super::*;

fn case(scores: &[Option<f64>], pole: [f64; 2]) -> WorstCase {
    WorstCase {
        name: "test".into(),
        method: Method::Vertex,
        flight_time: 0,
        values: Vec::new(),
        scores: scores.to_vec(),
        by_score: Vec::new(),
        objective: 0.0,
        pole,
        gap: None,
        switches: 0,
    }
}

#[test]
fn distance_and_likelihood_are_those_of_independent_normal_scores() {
    let case = case(&[Some(3.0), None, Some(-4.0)], [0.1, 30.0]);
    assert_eq!((case.distance(), case.farthest()), (5.0, 4.0));
    assert!((case.log10_likelihood() + 12.5 / 10.0_f64.ln()).abs() < 1e-12);
    assert!((case.time_to_double_s().unwrap() - 6.931_471_805_599_453).abs() < 1e-12);
    assert!((case.damping_ratio() + 0.1 / 30.0_f64.hypot(0.1)).abs() < 1e-15);
}

#[test]
fn a_case_stands_below_a_sample_by_its_ranges() {
    let sample = [0.3, 0.1, 0.2, f64::NAN];
    let standing = Standing::of(0.0, &sample).unwrap();
    assert_eq!((standing.worse, standing.cases), (0, 3));
    assert!((standing.ranges_below - 0.5).abs() < 1e-12);
    let inside = Standing::of(0.2, &sample).unwrap();
    assert_eq!(inside.worse, 2);
    assert!((inside.ranges_below + 0.5).abs() < 1e-12);
    assert_eq!(Standing::of(0.0, &[0.1]), None);
}

#[test]
fn no_method_gives_the_witness_of_independent_draws() {
    let all = [Method::Sample, Method::Vertex, Method::Corners, Method::Box, Method::Ellipsoid];
    for method in all {
        assert_eq!(method.drawing(), crate::stats::Drawing::Selected);
        assert!(method.drawing().independent().is_err(), "{}", method.name());
    }
    assert_eq!(Method::of(Region::Ball(1.0)), Method::Ellipsoid);
}
