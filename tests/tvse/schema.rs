//! The JSON Schemas that `tvse schema` prints, against the shipped files.

use crate::study::said;
use serde_json::Value as Json;
use std::path::Path;

/// Where `value` departs from `schema`, by a reading of the standard of our own: types, required
/// and additional properties, enumerations, bounds and alternatives.
fn departures(root: &Json, schema: &Json, value: &Json, at: &str, found: &mut Vec<String>) {
    if let Some(reference) = schema["$ref"].as_str() {
        let target = root.pointer(reference.trim_start_matches('#')).expect("a definition");
        departures(root, target, value, at, found);
    }
    for key in ["oneOf", "anyOf"] {
        let Some(alternatives) = schema[key].as_array() else { continue };
        let fits = |alternative: &&Json| {
            let mut found = Vec::new();
            departures(root, alternative, value, at, &mut found);
            found.is_empty()
        };
        let count = alternatives.iter().filter(fits).count();
        if count == 0 || (key == "oneOf" && count > 1) {
            found.push(format!("{at}: {count} of {key}"));
        }
    }
    let is = |name: &str| match name {
        "object" => value.is_object(),
        "array" => value.is_array(),
        "string" => value.is_string(),
        "boolean" => value.is_boolean(),
        "integer" => value.is_i64() || value.is_u64(),
        "number" => value.is_number(),
        other => other == "null" && value.is_null(),
    };
    let types = match &schema["type"] {
        Json::String(name) => vec![name.as_str()],
        Json::Array(names) => names.iter().filter_map(Json::as_str).collect(),
        _ => Vec::new(),
    };
    if !types.is_empty() && !types.iter().any(|name| is(name)) {
        found.push(format!("{at}: {value} is no {types:?}"));
    }
    if !schema["const"].is_null() && schema["const"] != *value {
        found.push(format!("{at}: {value} is not {}", schema["const"]));
    }
    if schema["enum"].as_array().is_some_and(|words| !words.contains(value)) {
        found.push(format!("{at}: {value} is not listed"));
    }
    if let Some(x) = value.as_f64() {
        let bound = |name: &str| schema[name].as_f64();
        let inside = bound("minimum").is_none_or(|b| x >= b)
            && bound("maximum").is_none_or(|b| x <= b)
            && bound("exclusiveMinimum").is_none_or(|b| x > b)
            && bound("exclusiveMaximum").is_none_or(|b| x < b);
        if !inside {
            found.push(format!("{at}: {x} is out of bounds"));
        }
    }
    if let Some(items) = value.as_array() {
        let count = items.len() as u64;
        if schema["minItems"].as_u64().is_some_and(|least| count < least)
            || schema["maxItems"].as_u64().is_some_and(|most| count > most)
        {
            found.push(format!("{at}: {count} items"));
        }
        for (i, item) in items.iter().enumerate().filter(|_| schema["items"].is_object()) {
            departures(root, &schema["items"], item, &format!("{at}[{i}]"), found);
        }
    }
    if let Some(object) = value.as_object() {
        for name in schema["required"].as_array().into_iter().flatten().filter_map(Json::as_str) {
            if !object.contains_key(name) {
                found.push(format!("{at}.{name} is missing"));
            }
        }
        for (name, value) in object {
            let at = format!("{at}.{name}");
            // Keys that end in a unit: `^(a|b)_[a-z0-9_]+$`.
            let pattern = |(pattern, _): &(&String, &Json)| {
                let words = pattern.trim_start_matches("^(").split(')').next().unwrap_or("");
                words.split('|').any(|word| name.starts_with(&format!("{word}_")))
            };
            let patterns = schema["patternProperties"].as_object();
            let matching = patterns.into_iter().flatten().find(pattern).map(|(_, schema)| schema);
            let property = match &schema["properties"][name] {
                Json::Null => matching.unwrap_or(&Json::Null),
                property => property,
            };
            match (property, &schema["additionalProperties"]) {
                (Json::Null, Json::Bool(false)) => found.push(format!("{at} is unknown")),
                (Json::Null, open @ Json::Object(_)) => departures(root, open, value, &at, found),
                (Json::Null, _) => {}
                (property, _) => departures(root, property, value, &at, found),
            }
        }
    }
}

fn check(kind: &str, text: &str) -> Vec<String> {
    let schema: Json = serde_json::from_str(&said(Path::new("."), &["schema", kind]).out).unwrap();
    let value = serde_json::to_value(text.parse::<toml::Table>().unwrap()).unwrap();
    let mut found = Vec::new();
    departures(&schema, &schema, &value, "", &mut found);
    found
}

#[test]
fn every_shipped_file_follows_its_schema() {
    for (kind, text) in [
        ("vehicle", include_str!("../../vehicles/sls-like/vehicle.toml")),
        ("stick", include_str!("../../vehicles/sls-like/stick.toml")),
        ("dispersion", include_str!("../../dispersions/reference.toml")),
        ("run", include_str!("../../runs/reference.toml")),
        ("run", include_str!("../../runs/all-engines.toml")),
        ("run", include_str!("../../runs/smoke.toml")),
        ("gates", include_str!("../../runs/reference.gates.toml")),
    ] {
        assert_eq!(check(kind, text), Vec::<String>::new(), "{kind}");
    }
}

#[test]
fn a_schema_finds_what_the_program_refuses() {
    let smoke = include_str!("../../runs/smoke.toml");
    for (from, to) in [
        ("cases = 50", "cases = 0"),
        ("cases = 50", "cases = 5000000000"),
        ("cases = 50", "casse = 50"),
        ("seed = 1", "seed = \"1\""),
        ("\"off\"", "\"of\""),
        ("[110.0]", "[]"),
    ] {
        let text = smoke.replacen(from, to, 1);
        assert_ne!(check("run", &text), Vec::<String>::new(), "{to}");
        let study = crate::study::Study::new();
        std::fs::write(study.path("runs/smoke.toml"), text).unwrap();
        assert_eq!(study.said(&["check", "runs/smoke.toml"]).code, 2, "{to}");
    }
}
