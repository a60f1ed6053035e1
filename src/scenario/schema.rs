//! JSON Schemas of the TOML files: what `table` checks each file against.
//!
//! The raw types belong to those who read them.

use super::import_file::ImportFile;
use super::run_file::RunFile;
use super::vehicle_file::VehicleFile;
use crate::dispersion::Table;
use crate::gate;
use crate::structure::raw::Stick;
use schemars::Schema;

/// A kind of TOML file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FileKind {
    /// A vehicle.
    Vehicle,
    /// A run definition.
    Run,
    /// A dispersion table.
    Dispersion,
    /// A stick model.
    Stick,
    /// An import description.
    Import,
    /// Gates.
    Gates,
}

/// The JSON Schema of a kind of file.
pub fn schema(kind: FileKind) -> Schema {
    match kind {
        FileKind::Vehicle => schemars::schema_for!(VehicleFile),
        FileKind::Run => schemars::schema_for!(RunFile),
        FileKind::Dispersion => schemars::schema_for!(Table),
        FileKind::Stick => schemars::schema_for!(Stick),
        FileKind::Import => schemars::schema_for!(ImportFile),
        FileKind::Gates => gate::schema(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::{fixture, table};
    use super::*;
    use schemars::JsonSchema;
    use serde::de::DeserializeOwned;
    use serde_json::Value as Json;
    use toml::Value;

    /// Every table of a document by its key path, itself included.
    fn tables(value: &Value, path: &str) -> Vec<String> {
        let mut found = Vec::new();
        match value {
            Value::Table(table) => {
                found.push(path.to_string());
                for (key, value) in table {
                    found.extend(tables(value, &format!("{path}/{key}")));
                }
            }
            Value::Array(items) => {
                for (i, item) in items.iter().enumerate() {
                    found.extend(tables(item, &format!("{path}/{i}")));
                }
            }
            _ => {}
        }
        found
    }

    fn at<'a>(value: &'a mut Value, path: &str) -> &'a mut toml::Table {
        let step = |value: &'a mut Value, part: &str| match value {
            Value::Array(items) => &mut items[part.parse::<usize>().unwrap()],
            other => &mut other[part],
        };
        path.split('/').skip(1).fold(value, step).as_table_mut().unwrap()
    }

    fn keys<T: DeserializeOwned + JsonSchema>(value: &Value) -> Vec<String> {
        let text = toml::to_string(value).unwrap();
        match table::read::<T>("f.toml", &text).and_then(|(raw, f)| f.finish(Some(raw))) {
            Ok(_) => Vec::new(),
            Err(problems) => problems.0.into_iter().map(|p| p.key).collect(),
        }
    }

    /// Drops each key of a good document in turn: the reader misses it exactly where the schema
    /// requires it; where it does not, the raw type has a default of its own.
    fn assert_agreement<T: DeserializeOwned + JsonSchema>(text: &str) {
        let good: Value = Value::Table(text.parse().unwrap());
        assert_eq!(keys::<T>(&good), Vec::<String>::new());
        let mut missed = 0;
        // The inputs of a path are signals by name: any key will do.
        for path in tables(&good, "").into_iter().filter(|path| !path.ends_with("/input")) {
            let table = at(&mut good.clone(), &path).clone();
            for key in table.keys() {
                let mut changed = good.clone();
                at(&mut changed, &path).remove(key);
                let found = keys::<T>(&changed);
                assert!(found.len() <= 1, "{path}/{key}: {found:?}");
                if let [place] = found.as_slice() {
                    // A table without its tag fits no variant: the table itself is at fault.
                    let table = path.rsplit('/').next().unwrap_or_default();
                    let item = format!("[{table}]");
                    let whole = place.ends_with(table) || place.ends_with(&item);
                    let named = place.ends_with(key.as_str()) || whole;
                    assert!(named, "{path}/{key}: {place}");
                    missed += 1;
                }
                let mut changed = good.clone();
                let entry = at(&mut changed, &path);
                let value = entry[key].clone();
                entry.insert(format!("{key}_and_more"), value);
                let found = keys::<T>(&changed);
                assert_eq!(found.len(), 1, "{path}/{key}: {found:?}");
                assert!(found[0].ends_with("_and_more"));
            }
        }
        assert!(missed > 0);
    }

    #[test]
    fn reader_and_schema_agree_on_what_is_required_and_what_is_known() {
        assert_agreement::<VehicleFile>(fixture::VEHICLE);
        assert_agreement::<RunFile>(include_str!("../../runs/reference.toml"));
        assert_agreement::<Table>(include_str!("../../dispersions/reference.toml"));
        assert_agreement::<Stick>(include_str!("../../vehicles/sls-like/stick.toml"));
    }

    #[test]
    fn reader_and_schema_agree_on_an_import_description() {
        assert_agreement::<ImportFile>(include_str!("../../docs/import/calculix/import.toml"));
    }

    /// Every property has a description and every object is closed, in a schema and below it.
    fn assert_described(schema: &Json, place: &str) {
        if let Some(properties) = schema["properties"].as_object() {
            assert_eq!(schema["additionalProperties"], false, "{place}");
            for (name, property) in properties {
                let reference = property["$ref"].is_string() || property["const"].is_string();
                assert!(property["description"].is_string() || reference, "{place}.{name}");
            }
        }
        match schema {
            Json::Object(entries) => {
                entries
                    .iter()
                    .for_each(|(key, value)| assert_described(value, &format!("{place}.{key}")));
            }
            Json::Array(items) => items.iter().for_each(|item| assert_described(item, place)),
            _ => {}
        }
    }

    #[test]
    fn every_key_of_every_file_is_described() {
        for kind in [
            FileKind::Vehicle,
            FileKind::Run,
            FileKind::Dispersion,
            FileKind::Stick,
            FileKind::Import,
        ] {
            assert_described(schema(kind).as_value(), &format!("{kind:?}"));
        }
        // Gates have open keys, of which the limits are made; the rest is described as well.
        assert!(schema(FileKind::Gates).as_value()["properties"]["gate"].is_object());
    }
}
