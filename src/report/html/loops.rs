//! Bode and Nichols charts of the flight control loops with the envelope of the cases.

use super::contents::{Contents, LoopCharts};
use super::{Section, word};
use crate::margins::AXES;
use crate::margins::envelope::{EnvelopeRow, LEVELS};
use crate::report::chart::{Area, Axis, Figure, Panel, legend, room};

/// Least magnitude drawn, dB.
const FLOOR_DB: f64 = -60.0;
/// Least magnitude in Nichols charts, dB: margins are looked for down to there.
pub const NICHOLS_FLOOR_DB: f64 = -40.0;
/// Change of phase from one frequency of the envelope to the next beyond which no line joins them, degrees.
const JUMP_DEG: f64 = 100.0;

/// The section, where the run has curves.
pub fn section(contents: &Contents) -> Option<Section> {
    let loops = contents.loops.as_ref()?;
    let mut section = Section::new("loops", "Flight control loops");
    for (place, &variant) in loops.plan.variants.iter().enumerate() {
        for axis in 0..AXES.len() {
            section.figures.extend(bode(contents, loops, variant, axis));
            section.figures.extend(nichols(contents, loops, (place, variant), axis));
        }
    }
    (!section.figures.is_empty()).then_some(section)
}

/// Rows of a population, variant and axis.
fn rows(
    loops: &LoopCharts,
    population: usize,
    variant: usize,
    axis: usize,
) -> impl Iterator<Item = &EnvelopeRow> + Clone {
    let wanted = move |row: &&EnvelopeRow| {
        (row.population, row.variant, row.axis) == (population, variant, axis)
    };
    loops.envelopes.iter().filter(wanted)
}

fn bode(contents: &Contents, loops: &LoopCharts, variant: usize, axis: usize) -> Option<Figure> {
    let definition = &contents.outline.definition;
    let name = &definition.variants[variant].name;
    let grid = &loops.plan.envelope_hz;
    let all = || rows(loops, contents.population, variant, axis);
    let (first, last) = (*grid.first()?, *grid.last()?);
    let id = format!("bode-{}-{}", word(name), AXES[axis]);
    let mut body = String::new();
    let mut any = false;
    type Spread = crate::margins::envelope::Spread;
    let magnitude: fn(&EnvelopeRow) -> Option<Spread> = |row| row.magnitude_db;
    let phase: fn(&EnvelopeRow) -> Option<Spread> = |row| row.phase_deg;
    for (place, label, of) in [(0, "magnitude, dB", magnitude), (1, "phase, °", phase)] {
        let median = LEVELS.iter().position(|level| *level == 0.5)?;
        let floor = if place == 0 { FLOOR_DB } else { f64::NEG_INFINITY };
        // Over the flight times: least and greatest of all; the medians one by one.
        let mut band = Vec::new();
        for &hertz in grid {
            let here = all().filter(|row| row.frequency_hz == hertz).filter_map(of);
            let ends = here.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), spread| {
                (low.min(spread.smallest), high.max(spread.largest))
            });
            if ends.0 <= ends.1 {
                band.push((hertz, ends.0, ends.1));
            }
        }
        if band.is_empty() {
            continue;
        }
        any = true;
        let y = room(band.iter().flat_map(|&(_, low, high)| [low.max(floor), high.max(floor)]));
        let area =
            Area { left: 74.0, top: 10.0 + place as f64 * 230.0, width: 780.0, height: 210.0 };
        let mut panel = Panel::new(
            format!("{id}-{place}"),
            area,
            Axis::logarithmic("frequency, Hz", [first, last]),
            Axis::linear(label, y),
        )
        .bare(place == 0, false);
        let series = variant % crate::report::chart::SERIES;
        panel.band(&band, &format!("fill s{series} wide"));
        for time in 0..definition.flight_times_s.len() {
            let line = all().filter(|row| row.flight_time == time);
            let line = line.filter_map(|row| Some((row.frequency_hz, of(row)?.quantiles[median])));
            panel.line(line, &format!("line thin s{series}"));
            let nominal = rows(loops, 0, variant, axis).filter(|row| row.flight_time == time);
            let nominal =
                nominal.filter_map(|row| Some((row.frequency_hz, of(row)?.quantiles[median])));
            panel.line(nominal, "ray");
        }
        if place == 0 {
            panel.level(0.0, "zero");
            for limit in [-1.0, 1.0] {
                panel.level(limit * loops.plan.settings.gain_margin_db, "limit");
            }
        } else {
            let [low, high] = y;
            let turns =
                ((low + 180.0) / 360.0).ceil() as i64..=((high + 180.0) / 360.0).floor() as i64;
            turns.for_each(|turn| panel.level(360.0 * turn as f64 - 180.0, "zero"));
        }
        panel.finish(&mut body);
    }
    any.then(|| Figure {
        id,
        title: format!("Bode chart of the {} loop, {name}", AXES[axis]),
        caption: "Broken at the axis command, the other loops closed. Band: least to greatest over all cases and flight \
                  times; lines: median of each flight time, dashed the nominal vehicle. Horizontal: 0 dB with the gain \
                  margin asked for; −180° and what differs from it by whole turns."
            .to_owned(),
        width: 890.0,
        height: 500.0,
        body,
    })
}

fn nichols(
    contents: &Contents,
    loops: &LoopCharts,
    (place, variant): (usize, usize),
    axis: usize,
) -> Option<Figure> {
    let definition = &contents.outline.definition;
    let name = &definition.variants[variant].name;
    let dots = loops.nichols.get(place)?.get(axis)?;
    if dots.is_empty() {
        return None;
    }
    let settings = &loops.plan.settings;
    let x = room(dots.iter().map(|dot| dot.x));
    let y = room(
        dots.iter().map(|dot| dot.y).chain([-settings.gain_margin_db, settings.gain_margin_db]),
    );
    let id = format!("nichols-{}-{}", word(name), AXES[axis]);
    let mut body = String::new();
    let names = [(variant, format!("{name}, all cases and flight times"))];
    let top = legend(&mut body, [64.0, 850.0], 4.0, &names) + 10.0;
    let area = Area { left: 74.0, top, width: 780.0, height: 380.0 };
    let mut panel =
        Panel::new(id.clone(), area, Axis::linear("phase, °", x), Axis::linear("magnitude, dB", y));
    panel.dots(dots, variant, 1.4, name, "cloud");
    panel.level(0.0, "zero");
    let [low, high] = x;
    let turns = ((low + 150.0) / 360.0).ceil() as i64..=((high + 210.0) / 360.0).floor() as i64;
    for turn in turns {
        let centre = 360.0 * turn as f64 - 180.0;
        let ellipse = (0..=72).map(|step| {
            let (sin, cos) = (f64::from(step) * std::f64::consts::TAU / 72.0).sin_cos();
            (centre + settings.phase_margin_deg * cos, settings.gain_margin_db * sin)
        });
        panel.line(ellipse, "limit");
        let cross = 6.0 * settings.phase_margin_deg / 30.0;
        panel.line([(centre - cross, 0.0), (centre + cross, 0.0)], "bound");
        panel.line([(centre, -1.0), (centre, 1.0)], "bound");
    }
    for time in 0..definition.flight_times_s.len() {
        let nominal = rows(loops, 0, variant, axis).filter(|row| row.flight_time == time);
        let points = nominal.filter_map(|row| {
            let median = LEVELS.iter().position(|level| *level == 0.5)?;
            Some((row.phase_deg?.quantiles[median], row.magnitude_db?.quantiles[median]))
        });
        // Between resonances the frequencies of the envelope lie too far apart to be joined.
        let mut line: Vec<(f64, f64)> = Vec::new();
        for point in points {
            let far = line.last().is_some_and(|last| (last.0 - point.0).abs() > JUMP_DEG);
            if far || point.1 <= NICHOLS_FLOOR_DB {
                panel.line(line.drain(..), "bound");
            }
            if point.1 > NICHOLS_FLOOR_DB {
                line.push(point);
            }
        }
        panel.line(line, "bound");
    }
    panel.finish(&mut body);
    Some(Figure {
        id,
        title: format!("Nichols chart of the {} loop, {name}", AXES[axis]),
        caption: format!(
            "Lines: the nominal vehicle at each flight time. Marks: the loops of all cases at the frequencies of the \
             envelope, one for each cell of 1/240 by 1/150 above {} dB; phases as in the envelope, next to the nominal one's. \
             Dashed: the ellipse of {} dB and {}° about each critical point.",
            super::number(NICHOLS_FLOOR_DB),
            super::number(settings.gain_margin_db),
            super::number(settings.phase_margin_deg)
        ),
        width: 890.0,
        height: top + 380.0 + 46.0,
        body,
    })
}
