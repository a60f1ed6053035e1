//! How charts look: colours of Okabe and Ito, which stay apart for colour-blind readers, one mark a series,
//! and light and dark variants of both.

/// Number of series that are told apart; further ones begin again.
pub const SERIES: usize = 7;

/// Style of charts on white.
pub const LIGHT: &str = "\
.tvse text{font-family:'DejaVu Sans',Verdana,sans-serif;font-size:11px;fill:#222}\
.tvse .label{font-size:12px}.tvse .head{font-size:12px;font-weight:bold}.tvse .small{font-size:9.5px}\
.tvse .note{fill:#555}.tvse .ground{fill:#fff}\
.tvse .frame{fill:none;stroke:#888;stroke-width:1}.tvse .grid{stroke:#e2e2e2;stroke-width:1;fill:none}\
.tvse .zero{stroke:#222;stroke-width:1.2;fill:none}\
.tvse .ray{stroke:#999;stroke-width:0.8;stroke-dasharray:5 3;fill:none}\
.tvse .strong{stroke:#222;stroke-width:1.2;stroke-dasharray:7 3;fill:none}\
.tvse .limit{stroke:#b00020;stroke-width:1.6;stroke-dasharray:6 3;fill:none}.tvse .limit-text{fill:#b00020}\
.tvse .bound{stroke:#222;stroke-width:1.4;fill:none}\
.tvse .rest{stroke:#b5b5b5;stroke-width:1.2;fill:none}.tvse .body{stroke:#0072b2;stroke-width:1.8;fill:none}\
.tvse .nozzle{stroke:#d55e00;stroke-width:3;fill:none;stroke-linecap:round}\
.tvse .dots{stroke:none}.tvse .line{fill:none;stroke-width:1.6}.tvse .thin{stroke-width:0.9}\
.tvse .dashed{stroke-dasharray:5 3}.tvse .nominal{stroke:#000;stroke-width:1.3}\
.tvse .fill.s0{fill:#d55e00}.tvse .fill.s1{fill:#0072b2}.tvse .fill.s2{fill:#009e73}\
.tvse .fill.s3{fill:#e69f00}.tvse .fill.s4{fill:#cc79a7}.tvse .fill.s5{fill:#56b4e9}.tvse .fill.s6{fill:#555}\
.tvse .line.s0{stroke:#d55e00}.tvse .line.s1{stroke:#0072b2}.tvse .line.s2{stroke:#009e73}\
.tvse .line.s3{stroke:#e69f00}.tvse .line.s4{stroke:#cc79a7}.tvse .line.s5{stroke:#56b4e9}.tvse .line.s6{stroke:#555}\
.tvse .cloud{fill-opacity:0.55}.tvse .wide{fill-opacity:0.16}.tvse .middle{fill-opacity:0.22}.tvse .narrow{fill-opacity:0.3}";

/// What differs on a dark ground.
pub const DARK: &str = "\
.tvse text{fill:#e4e4e4}.tvse .note{fill:#aaa}.tvse .ground{fill:#16181c}\
.tvse .frame{stroke:#888}.tvse .grid{stroke:#33363c}.tvse .zero{stroke:#e4e4e4}.tvse .ray{stroke:#888}\
.tvse .strong{stroke:#e4e4e4}.tvse .limit{stroke:#ff6b7a}.tvse .limit-text{fill:#ff6b7a}.tvse .bound{stroke:#e4e4e4}\
.tvse .rest{stroke:#5c6168}.tvse .body{stroke:#4db1f0}.tvse .nozzle{stroke:#ff8c3a}.tvse .nominal{stroke:#fff}\
.tvse .fill.s0{fill:#ff8c3a}.tvse .fill.s1{fill:#4db1f0}.tvse .fill.s2{fill:#1fc796}.tvse .fill.s6{fill:#bbb}\
.tvse .line.s0{stroke:#ff8c3a}.tvse .line.s1{stroke:#4db1f0}.tvse .line.s2{stroke:#1fc796}.tvse .line.s6{stroke:#bbb}";

/// The outline of the mark of a series about the point to which the pen was moved, `r` its half width.
pub(super) fn mark(series: usize, r: f64) -> String {
    let d = 2.0 * r;
    match series % SERIES {
        0 => format!("m{:.2} 0a{r:.2} {r:.2} 0 1 0 {d:.2} 0a{r:.2} {r:.2} 0 1 0 {:.2} 0z", -r, -d),
        1 => format!("m{:.2} {:.2}h{d:.2}v{d:.2}h{:.2}z", -r, -r, -d),
        2 => format!("m0 {:.2}l{r:.2} {d:.2}h{:.2}z", -1.2 * r, -d),
        3 => format!("m0 {0:.2}l{1:.2} {1:.2}l{0:.2} {1:.2}l{0:.2} {0:.2}z", -1.3 * r, 1.3 * r),
        4 => format!("m0 {:.2}l{:.2} {:.2}h{d:.2}z", 1.2 * r, -r, -d),
        5 => {
            let (w, t) = (1.3 * r, 0.45 * r);
            let (e, t2) = (w - t, 2.0 * t);
            format!(
                "m{:.2} {:.2}h{t2:.2}v{e:.2}h{e:.2}v{t2:.2}h{:.2}v{e:.2}h{:.2}v{:.2}h{:.2}v{:.2}h{e:.2}z",
                -t, -w, -e, -t2, -e, -e, -t2
            )
        }
        _ => format!("m{:.2} {:.2}h{:.2}v{:.2}h{:.2}z", -1.4 * r, -0.5 * r, 2.8 * r, r, -2.8 * r),
    }
}
