//! `tvse report`: one page and its figures, the same bytes each time, of a whole run or of two.

use crate::study::Study;
use std::fs;

#[test]
fn a_report_is_one_file_with_every_section_and_the_same_bytes_each_time() {
    let study = Study::new();
    assert_eq!(study.said(&["run", "runs/smoke.toml"]).code, 0);
    let said = study.said(&["report", "runs/smoke", "--figures", "figures"]);
    assert_eq!(said.code, 0, "{}", said.err);
    let page = study.text("runs/smoke/report.html");
    for section in
        ["summary", "poles", "distribution", "tornado", "worst", "added", "shape", "provenance"]
    {
        assert!(page.contains(&format!("<section id=\"{section}\">")), "{section}");
    }
    assert!(page.contains("tvse replay runs/smoke --case"));
    assert!(!page.contains("http://") && !page.contains("https://") && !page.contains("url(\""));
    for name in ["poles-tvse", "shape-tvse", "distribution-tvse"] {
        let svg = study.text(&format!("figures/{name}.svg"));
        assert!(svg.starts_with("<svg xmlns=") && svg.trim_end().ends_with("</svg>"));
        let png = fs::read(study.path(&format!("figures/{name}.png"))).unwrap();
        assert!(png.starts_with(b"\x89PNG") && png.len() > 5000, "{name}");
    }
    assert_eq!(study.said(&["report", "runs/smoke", "-o", "runs/smoke/again.html"]).code, 0);
    assert_eq!(study.text("runs/smoke/again.html"), page);
}

#[test]
fn two_runs_are_compared_on_common_draws_and_refused_without() {
    let study = Study::new();
    assert_eq!(study.said(&["run", "runs/smoke.toml", "-o", "a"]).code, 0);
    study.edit("runs/smoke.toml", "gimballed = [\"booster.*\"]", "gimballed = [\"*.*\"]");
    assert_eq!(study.said(&["run", "runs/smoke.toml", "-o", "b"]).code, 0);
    let said = study.said(&["report", "b", "--compare", "a", "-o", "both.html"]);
    assert_eq!(said.code, 0, "{}", said.err);
    let page = study.text("both.html");
    assert!(page.contains("<section id=\"compare\">") && page.contains("6 common cases"));
    study.edit("runs/smoke.toml", "seed = 1", "seed = 2");
    assert_eq!(study.said(&["run", "runs/smoke.toml", "-o", "c"]).code, 0);
    let said = study.said(&["report", "c", "--compare", "a", "-o", "none.html"]);
    assert_eq!(said.code, 2);
    assert!(said.err.contains("the same draws"), "{}", said.err);
    assert!(!study.path("none.html").exists());
}

#[test]
fn failed_cases_and_gates_are_in_the_report() {
    let study = Study::new();
    study.edit("runs/smoke.toml", "cases = 6", "cases = 12");
    assert_eq!(study.said(&["run", "runs/smoke.toml"]).code, 0);
    fs::write(
        study.path("gates.toml"),
        "[[gate]]\nid = \"damped\"\nmetric = \"damping_ratio\"\nvariant = \"jet_damping\"\nmode = \"tvse\"\n\
         statistic = \"minimum\"\nat_least_1 = 0.5\nrationale = \"<never>\"\n",
    )
    .unwrap();
    let said = study.said(&["report", "runs/smoke", "--gates", "gates.toml"]);
    assert_eq!(said.code, 0, "{}", said.err);
    let page = study.text("runs/smoke/report.html");
    assert!(page.contains("Gate damped: fail") && page.contains("id=\"gate-damped\""));
    assert!(page.contains("0 of 12 cases failed") && !page.contains("<never>"));
}
