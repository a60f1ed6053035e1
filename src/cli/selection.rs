//! What a command is asked to look at in a finished run, by name; tables written as CSV.

use super::Error;
use crate::campaign::metric::{Quantity, metrics};
use crate::io::{Run, files, schema};
use crate::report::statistics::Rows;
use crate::spelling::allowed_instead;
use std::path::Path;

/// Index of the population called `name`.
pub fn population(run: &Run, name: &str) -> Result<usize, Error> {
    let names = || run.outline().definition.populations.iter().map(|p| p.name.as_str());
    names().position(|known| known == name).ok_or_else(|| {
        let allowed = allowed_instead(name, names());
        Error::Usage(format!("--population: found \"{name}\"; allowed: {allowed}"))
    })
}

/// The columns of the table `cases` that are asked for; the smallest damping ratios unless some are.
/// Only those that every case has which did not fail.
pub fn columns(run: &Run, asked: &[String]) -> Result<Vec<String>, Error> {
    let mut all = metrics(&run.outline().definition);
    all.retain(|metric| !schema::null_is_good(&metric.name));
    if asked.is_empty() {
        let damping = all.into_iter().filter(|m| m.quantity == Quantity::DampingRatioMin);
        return Ok(damping.map(|metric| metric.name).collect());
    }
    let known = |name: &String| match all.iter().any(|metric| metric.name == *name) {
        true => Ok(name.clone()),
        false => {
            let allowed = allowed_instead(name, all.iter().map(|m| m.name.as_str()));
            Err(Error::Usage(format!("--metric: found \"{name}\"; allowed: {allowed}")))
        }
    };
    asked.iter().map(known).collect()
}

/// The values of columns of the table `cases` by case, NaN where a case failed.
pub fn values(run: &Run, population: usize, names: &[String]) -> Result<Vec<Vec<f64>>, Error> {
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let mut columns = vec![Vec::new(); names.len()];
    run.cases(population, &names, |_, values, _| {
        columns.iter_mut().zip(values).for_each(|(column, value)| column.push(*value));
        Ok(())
    })?;
    Ok(columns)
}

/// Writes a table to the folder `analysis` of a run, in place of the one of an earlier call, and to a new
/// file if one is asked for; says where to.
pub fn keep(
    run: &Path,
    name: &str,
    copy: Option<&Path>,
    rows: &Rows,
    out: &mut dyn std::io::Write,
) -> Result<(), Error> {
    let path = run.join("analysis").join(name);
    files::create_parents(&path)?;
    files::write(&path, rows.csv().as_bytes())?;
    writeln!(out, "{}", path.display())?;
    write(copy, rows)
}

/// Writes a table to a new file, if one is asked for.
pub fn write(path: Option<&Path>, rows: &Rows) -> Result<(), Error> {
    if let Some(path) = path {
        files::refuse_existing(path)?;
        files::write(path, rows.csv().as_bytes())?;
    }
    Ok(())
}
