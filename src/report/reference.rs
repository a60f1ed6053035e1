//! Reference pages in Markdown: the keys of a TOML file from its JSON Schema, columns, and statistics with
//! what they assume.
//!
//! Nothing is said here that the registries do not say, but for the assumptions of statistics.

use serde_json::Value;
use std::fmt::Write;

/// Says that a page is not written by hand.
const MADE: &str = "<!-- Made by `tvse reference docs/reference`; a test keeps it so. -->\n\n";

/// Appends to a string.
macro_rules! add {
    ($text:expr, $($arguments:tt)*) => {
        writeln!($text, $($arguments)*).expect("a string takes any text")
    };
}

/// A text in a cell of a table.
fn cell(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ").replace('|', "\\|").replace('<', "&lt;")
}

fn words<'a>(value: &'a Value, key: &str) -> &'a str {
    value[key].as_str().unwrap_or_default()
}

/// The page of a kind of file.
pub fn keys(title: &str, about: &str, schema: &Value) -> String {
    let mut page = format!("{MADE}# {title}\n\n{about}\n\n{}\n\n", words(schema, "description"));
    object(&mut page, schema);
    for (name, part) in schema["$defs"].as_object().into_iter().flatten() {
        add!(page, "## {name}\n\n{}\n", words(part, "description"));
        alternatives(&mut page, part);
        object(&mut page, part);
    }
    page
}

/// A table of the keys of an object.
fn object(page: &mut String, object: &Value) {
    let Some(keys) = object["properties"].as_object() else { return };
    let required: Vec<&str> =
        object["required"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
    add!(page, "| key | value | needed | default | meaning |\n| --- | --- | --- | --- | --- |");
    for (key, value) in keys {
        let needed = if required.contains(&key.as_str()) { "yes" } else { "" };
        let default = &value["default"];
        let default = if default.is_null() { String::new() } else { format!("`{default}`") };
        let meaning = cell(words(value, "description"));
        add!(page, "| `{key}` | {} | {needed} | {default} | {meaning} |", kind(value));
    }
    for (pattern, value) in object["patternProperties"].as_object().into_iter().flatten() {
        add!(page, "| `{}` | {} | | | any key of this form |", cell(pattern), kind(value));
    }
    page.push('\n');
}

/// The alternatives of a value: words with their meaning, or objects told apart by a word.
fn alternatives(page: &mut String, part: &Value) {
    let all = ["oneOf", "anyOf"].into_iter().filter_map(|key| part[key].as_array()).flatten();
    let listed = part["enum"].as_array().into_iter().flatten();
    for word in listed {
        add!(page, "- `{word}`");
    }
    let mut any = part["enum"].is_array();
    for alternative in all {
        any = true;
        let about = cell(words(alternative, "description"));
        if !alternative["const"].is_null() {
            add!(page, "- `{}`: {about}", alternative["const"]);
        } else if let Some(keys) = alternative["properties"].as_object() {
            let told = keys.iter().find(|(_, value)| !value["const"].is_null());
            let told = told.map_or(String::new(), |(key, v)| format!("`{key} = {}`", v["const"]));
            add!(page, "\n### {told}\n\n{about}\n");
            object(page, alternative);
        } else {
            for word in alternative["enum"].as_array().into_iter().flatten() {
                add!(page, "- `{word}`");
            }
            if !alternative["$ref"].is_null() || !alternative["type"].is_null() {
                add!(
                    page,
                    "- {}{}{about}",
                    kind(alternative),
                    if about.is_empty() { "" } else { ": " }
                );
            }
        }
    }
    if any {
        page.push('\n');
    }
}

/// What a value is, with its bounds.
fn kind(value: &Value) -> String {
    let mut text = if let Some(reference) = value["$ref"].as_str() {
        let name = reference.rsplit('/').next().unwrap_or_default();
        format!("[{name}](#{})", name.to_lowercase())
    } else if let Some(choices) = value["anyOf"].as_array().or(value["oneOf"].as_array()) {
        let choices = choices.iter().filter(|choice| choice["type"] != "null");
        choices.map(kind).collect::<Vec<_>>().join(" or ")
    } else if !value["const"].is_null() {
        format!("`{}`", value["const"])
    } else if let Some(listed) = value["enum"].as_array() {
        let listed = listed.iter().filter(|word| !word.is_null());
        listed.map(|word| format!("`{word}`")).collect::<Vec<_>>().join(", ")
    } else {
        let types: Vec<&str> = match &value["type"] {
            Value::String(name) => vec![name.as_str()],
            Value::Array(names) => names.iter().filter_map(Value::as_str).collect(),
            _ => Vec::new(),
        };
        let types = types.into_iter().filter(|name| *name != "null");
        let said = types.map(|name| match name {
            "array" if value["prefixItems"].is_array() => "list".to_owned(),
            "array" => format!("list of {}", kind(&value["items"])),
            "object" if value["additionalProperties"].is_object() => {
                format!("table of {}", kind(&value["additionalProperties"]))
            }
            "object" => "table".to_owned(),
            "string" => "text".to_owned(),
            other => other.to_owned(),
        });
        said.collect::<Vec<_>>().join(" or ")
    };
    for (key, sign) in
        [("minimum", "≥"), ("exclusiveMinimum", ">"), ("maximum", "≤"), ("exclusiveMaximum", "<")]
    {
        if let Some(bound) = value[key].as_f64() {
            let sign = if sign == "<" { "&lt;" } else { sign };
            write!(text, ", {sign} {bound}").expect("a string takes any text");
        }
    }
    if let (Some(least), most) = (value["minItems"].as_u64(), value["maxItems"].as_u64()) {
        let count = match most {
            Some(most) if most == least => format!(", {least} of them"),
            Some(most) => format!(", {least} to {most} of them"),
            None => format!(", at least {least}"),
        };
        text.push_str(&count);
    }
    text
}

/// The page of the columns: table, name, type, unit and meaning of each, tables in order.
pub fn columns<'a>(all: impl Iterator<Item = [&'a str; 5]>) -> String {
    let mut page = format!(
        "{MADE}# Columns\n\nThe tables of a run, `tables/<table>.parquet` in its folder: flat columns, NULL (never NaN) where \
         there is no value, units in names and in the field metadata. `<variant>` and `<mode>` stand for the names that a run \
         gives, `<key>` for a draw key as a column name; the table `columns` of a run has them spelt out. Tables of loops \
         are there where a run asks for margins, columns of outer draws and replicates where its plan has them.\n"
    );
    let mut last = "";
    for [table, name, type_name, unit, description] in all {
        if table != last {
            add!(
                page,
                "\n## {table}\n\n| column | type | unit | meaning |\n| --- | --- | --- | --- |"
            );
            last = table;
        }
        let unit = if unit.is_empty() { "–" } else { unit };
        add!(page, "| `{name}` | {} | {} | {} |", cell(type_name), cell(unit), cell(description));
    }
    page
}

/// A statistic: the word in tables and files, what it is, what it assumes.
pub struct Assumed {
    /// The word, as registries have it.
    pub word: &'static str,
    /// What it is.
    pub what: &'static str,
    /// What must hold for it.
    pub assumes: &'static str,
}

const fn assumed(word: &'static str, what: &'static str, assumes: &'static str) -> Assumed {
    Assumed { word, what, assumes }
}

/// How intervals are made, by the words of the column `interval by` of `tvse statistics`.
pub const METHODS: [Assumed; 7] = [
    assumed(
        "clopper_pearson",
        "Exact binomial interval of a share",
        "Independent draws. Conservative: covers at least as often as stated. Failed cases count as bad.",
    ),
    assumed(
        "student_t",
        "Interval of a mean, of paired differences, of regression coefficients",
        "Independent draws; means near normal, which skewed samples reach slowly; for coefficients a linear model with normal errors.",
    ),
    assumed(
        "fisher",
        "Interval of a partial rank correlation by Fisher's transformation",
        "Independent draws; approximate, for ranks that are near bivariate normal after transformation.",
    ),
    assumed(
        "order_statistics",
        "Distribution-free interval of a quantile, tolerance bound (Wilks)",
        "Independent draws of a continuous law, no law assumed. Not claimed for Latin hypercube or Sobol samples. Failed cases lie beyond every value on the worse side.",
    ),
    assumed(
        "replicates",
        "Student's t over the results of independent replicates or outer draws",
        "Replicates independent of each other and near normal in their result; two at least, more for a useful width. Quantiles, deviation, skewness and kurtosis: about the value of all cases (sectioning), quantiles only where each replicate has five cases beyond them.",
    ),
    assumed(
        "bootstrap_percentile",
        "Percentile bootstrap",
        "Independent draws, or rows of a Saltelli plan; approximate; resamples are a function of the seed.",
    ),
    assumed(
        "bootstrap_bca",
        "Bias-corrected and accelerated bootstrap (Efron)",
        "Independent draws; approximate, second-order correct; quantiles only where 20 cases are expected beyond them.",
    ),
];

/// Statistics of gates, by their word in gate files.
pub const GATES: [Assumed; 8] = [
    assumed(
        "minimum",
        "The least value of the cases",
        "A statement about the evaluated cases alone.",
    ),
    assumed(
        "maximum",
        "The greatest value of the cases",
        "A statement about the evaluated cases alone.",
    ),
    assumed(
        "share_below",
        "Share of the population below a threshold, by its exact bound",
        "Independent draws; failed cases count as below.",
    ),
    assumed(
        "share_above",
        "Share of the population above a threshold, by its exact bound",
        "Independent draws; failed cases count as above.",
    ),
    assumed(
        "quantile",
        "A quantile of the population, by its distribution-free bound",
        "Independent draws; failed cases lie on the worse side.",
    ),
    assumed(
        "tolerance_bound",
        "What a share of the population keeps, with a consumer's risk",
        "Independent draws; failed cases lie on the worse side. No law is assumed.",
    ),
    assumed(
        "nested_statement",
        "Share of outer draws of a nested plan that meet its statement, by its exact bound",
        "Independent outer draws, and independent inner cases within each; failed cases count as below. An outer draw that is undecided does not meet it.",
    ),
    assumed(
        "worst_on_worst",
        "The worst that a search found in a region of the draws",
        "Nothing about a population: it was searched for, not sampled. A search may miss a worse point.",
    ),
];

/// The page of the statistics; `said` is what the schema of gates says of each of theirs, and
/// `levels` the quantiles of the summary.
pub fn statistics(said: &[(String, String)], levels: &[(f64, &str)]) -> String {
    let mut page = format!(
        "{MADE}# Statistics and what they assume\n\nA case counts once, with its worst flight time, wherever a statement is about vehicles. Several \
         intervals at once: the summary says how many there are, how many miss on average, and the level of each that keeps all \
         together (Bonferroni).\n\n## Intervals\n\n| word | what | assumes |\n| --- | --- | --- |\n"
    );
    for method in &METHODS {
        add!(page, "| `{}` | {} | {} |", method.word, cell(method.what), cell(method.assumes));
    }
    add!(
        page,
        "\n## Statistics of gates\n\n| word | what | assumes | in the file |\n| --- | --- | --- | --- |"
    );
    for gate in &GATES {
        let said = said.iter().find(|(word, _)| word == gate.word).map_or("", |(_, text)| text);
        add!(
            page,
            "| `{}` | {} | {} | {} |",
            gate.word,
            cell(gate.what),
            cell(gate.assumes),
            cell(said)
        );
    }
    add!(
        page,
        "\n## Quantiles of the summary\n\nLinear between order statistics (type 7 of Hyndman and Fan); 0.135 % and 99.865 % lie three standard \
         deviations from the mean of a normal law. Their intervals are between order statistics.\n\n| column ends with | level |\n| --- | --- |"
    );
    for (level, word) in levels {
        add!(page, "| `{word}` | {level} |");
    }
    add!(
        page,
        "\n## Sensitivity\n\n| in `tvse sensitivity` | what | assumes |\n| --- | --- | --- |\n\
         | SRC | Standardised regression coefficient, interval `student_t` | Independent draws; a linear model, whose share of the variance is printed |\n\
         | PRCC | Partial rank correlation, interval `fisher` | Independent draws; a monotone model |\n\
         | first order | Share of the variance that the draw alone explains; from given data (bins of equal count, bias taken off) or of a Saltelli plan | Independent draws, or a Saltelli plan |\n\
         | total | Share with all interactions (Jansen), interval `bootstrap_percentile` over rows | A Saltelli plan |\n\
         | low, high | Mean over the cases in the lowest and in the highest tenth of the draw, or the two cases of a one-at-a-time plan | Nothing; no interval |"
    );
    page
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_schema_becomes_tables_with_links_and_bounds() {
        let schema = json!({
            "description": "A thing.",
            "properties": {
                "a": { "description": "One | two.", "type": ["integer", "null"], "minimum": 1 },
                "b": { "$ref": "#/$defs/Kind" },
                "c": { "type": "array", "items": { "type": "number" }, "minItems": 2, "maxItems": 2 }
            },
            "required": ["b"],
            "$defs": { "Kind": { "description": "Which.", "oneOf": [
                { "const": "x", "description": "The first." },
                { "description": "The second.", "properties": { "kind": { "const": "y" }, "q": { "type": "number", "exclusiveMaximum": 1.0 } } }
            ] } }
        });
        let page = keys("Things", "", &schema);
        assert!(page.contains("| `a` | integer, ≥ 1 |  |  | One \\| two. |"), "{page}");
        assert!(page.contains("| `b` | [Kind](#kind) | yes |"), "{page}");
        assert!(page.contains("| `c` | list of number, 2 of them |"), "{page}");
        assert!(page.contains("- `\"x\"`: The first."), "{page}");
        assert!(
            page.contains("### `kind = \"y\"`") && page.contains("| `q` | number, &lt; 1 |"),
            "{page}"
        );
    }

    #[test]
    fn every_method_of_an_interval_has_its_assumptions() {
        use crate::stats::Method;
        let all = [
            Method::ClopperPearson,
            Method::StudentT,
            Method::Fisher,
            Method::OrderStatistics,
            Method::Replicates,
            Method::BootstrapPercentile,
            Method::BootstrapBca,
        ];
        let words: Vec<&str> = METHODS.iter().map(|method| method.word).collect();
        assert_eq!(words, all.map(Method::name));
    }
}
