//! Reader of a TOML file: its values against the schema of a raw type, with all problems at once.
//!
//! The schema is derived from the raw type, so what `tvse schema` prints is what is checked here.
//! What values mean together is not known here: the caller checks it and adds to the [`Findings`].

use crate::problem::{Kind, Problems};
use crate::spelling;
use schemars::JsonSchema;
use serde::de::DeserializeOwned;
use serde_json::Value as Json;
use toml::Value;

/// The problems of one file, and the places whose values could not be read.
#[derive(Debug)]
pub struct Findings {
    file: String,
    problems: Problems,
    unread: Vec<String>,
}

impl Findings {
    /// Adds a problem, unless it follows from a value of the same table that could not be read.
    pub fn push(
        &mut self,
        key: impl Into<String>,
        found: impl Into<String>,
        allowed: impl Into<String>,
    ) {
        let key = key.into();
        let follows = self.unread.iter().any(|place| {
            key.strip_prefix(place.as_str())
                .is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
        });
        if !follows {
            self.problems.push(Kind::Input, &self.file, key, found, allowed);
        }
    }

    /// Adds the problems of a file to which this one refers.
    pub fn extend(&mut self, other: Problems) {
        self.problems.extend(other);
    }

    /// The value, if it could be made and nothing is wrong.
    pub fn finish<T>(self, value: Option<T>) -> Result<T, Problems> {
        match value {
            Some(value) => self.problems.into_result(value),
            // A value is only missing because of a problem; should none be listed, say so.
            None if self.problems.0.is_empty() => {
                Err(Problems::input(self.file, "", "contradictory values", "a consistent file"))
            }
            None => Err(self.problems),
        }
    }

    /// The file as the user named it.
    pub fn file(&self) -> &str {
        &self.file
    }
}

/// Reads `text` into the raw type `T`.
///
/// The raw value holds placeholders where a value could not be read; those places are known to
/// the [`Findings`], through which the caller must pass to get at a result.
///
/// # Errors
/// Text that is not TOML at all.
pub fn read<T: DeserializeOwned + JsonSchema>(
    file: &str,
    text: &str,
) -> Result<(T, Findings), Problems> {
    let table: toml::Table = text.parse().map_err(|error: toml::de::Error| {
        let line = |at: usize| format!("line {}", text[..at].matches('\n').count() + 1);
        let place = error.span().map_or(String::new(), |span| line(span.start));
        Problems::input(file, place, error.message(), "TOML 1.1")
    })?;
    let schema = schemars::schema_for!(T).to_value();
    let findings =
        Findings { file: file.into(), problems: Problems::default(), unread: Vec::new() };
    let mut reader = Reader { schema: &schema, findings };
    let mut value = Value::Table(table);
    reader.check(&schema, &mut value, "");
    let mut findings = reader.findings;
    match value.try_into() {
        Ok(raw) => Ok((raw, findings)),
        Err(error) => {
            findings.push("", error.message(), "a value that fits the schema");
            Err(findings.problems)
        }
    }
}

struct Reader<'a> {
    schema: &'a Json,
    findings: Findings,
}

impl<'a> Reader<'a> {
    /// Follows references and drops the alternative `null`, which TOML does not have.
    fn resolve(&self, mut schema: &'a Json) -> &'a Json {
        loop {
            let only = match alternatives(schema).as_slice() {
                [only] => Some(*only),
                _ => None,
            };
            let target = schema["$ref"].as_str().and_then(|r| self.schema.pointer(&r[1..]));
            match target.or(only) {
                Some(next) => schema = next,
                None => return schema,
            }
        }
    }

    /// Checks `value` against `schema` and repairs it, so that reading can go on.
    fn check(&mut self, schema: &'a Json, value: &mut Value, key: &str) {
        let schema = self.tagged(self.resolve(schema), value);
        match (kind(schema), &mut *value) {
            ("object", Value::Table(table)) => self.check_table(schema, table, key),
            ("array", Value::Array(items)) => {
                let count = items.len() as u64;
                let enough = schema["minItems"].as_u64().is_none_or(|least| count >= least);
                if !enough || schema["maxItems"].as_u64().is_some_and(|most| count > most) {
                    self.refuse(schema, value, key, format!("{count} entries"));
                } else if schema["items"].is_object() {
                    for (i, item) in items.iter_mut().enumerate() {
                        self.check(&schema["items"], item, &format!("{key}[{i}]"));
                    }
                }
            }
            ("number", Value::Float(x)) if inside(schema, *x) => {}
            ("number" | "integer", Value::Integer(n)) if inside(schema, *n as f64) => {}
            ("boolean", Value::Boolean(_)) => {}
            ("string", Value::String(text)) => {
                let words = self.words(schema);
                if !words.is_empty() && !words.contains(&text.as_str()) {
                    let allowed = spelling::allowed_instead(text, words.iter().copied());
                    let found = format!("\"{text}\"");
                    *value = self.placeholder(schema);
                    self.problem_unread(key, found, allowed);
                }
            }
            _ => {
                let tag = value.as_table().zip(self.tags(schema).first().copied());
                let Some((table, (tag, _))) = tag else {
                    let found = describe(value);
                    return self.refuse(schema, value, key, found);
                };
                // A tagged table without one of the tags.
                let words = self.tags(schema).into_iter().map(|(_, word)| word);
                let (found, allowed) = match table.get(tag) {
                    Some(Value::String(word)) => {
                        (format!("\"{word}\""), spelling::allowed_instead(word, words))
                    }
                    other => {
                        let all = words.collect::<Vec<_>>().join(", ");
                        (other.map_or("nothing".into(), describe), format!("one of {all}"))
                    }
                };
                *value = self.placeholder(schema);
                self.problem(&format!("{key}.{tag}"), found, allowed);
                self.leave(key);
            }
        }
    }

    fn check_table(&mut self, schema: &'a Json, table: &mut toml::Table, key: &str) {
        let at = |name: &str| if key.is_empty() { name.into() } else { format!("{key}.{name}") };
        let none = serde_json::Map::new();
        let properties = schema["properties"].as_object().unwrap_or(&none);
        let required: Vec<&str> =
            schema["required"].as_array().into_iter().flatten().filter_map(Json::as_str).collect();
        let open = &schema["additionalProperties"];
        let unknown: Vec<String> =
            table.keys().filter(|name| !properties.contains_key(*name)).cloned().collect();
        for name in unknown.iter().filter(|_| !open.is_object()) {
            let value = table.remove(name);
            let free = properties.keys().map(String::as_str).filter(|k| !table.contains_key(*k));
            self.problem(
                &at(name),
                format!("unknown key `{name}`"),
                spelling::allowed_instead(name, free.clone()),
            );
            // A misspelt key is read as the one that was meant, so that its value is checked too.
            if let (Some(meant), Some(value)) = (spelling::nearest(name, free), value) {
                let meant = meant.to_string();
                table.insert(meant, value);
            }
        }
        for (name, value) in table.iter_mut() {
            let property = schema["properties"].get(name).unwrap_or(open);
            self.check(property, value, &at(name));
        }
        for name in
            required.into_iter().filter(|name| !table.contains_key(*name)).collect::<Vec<_>>()
        {
            let property = self.resolve(&schema["properties"][name]);
            table.insert(name.into(), self.placeholder(property));
            let allowed = self.allowed(property);
            self.problem_unread(&at(name), "nothing".into(), allowed);
        }
    }

    fn refuse(&mut self, schema: &'a Json, value: &mut Value, key: &str, found: String) {
        *value = self.placeholder(schema);
        let allowed = self.allowed(schema);
        self.problem_unread(key, found, allowed);
    }

    fn problem(&mut self, key: &str, found: String, allowed: String) {
        self.findings.problems.push(Kind::Input, &self.findings.file, key, found, allowed);
    }

    /// Adds a problem after which the other values of the same table are not judged further.
    fn problem_unread(&mut self, key: &str, found: String, allowed: String) {
        self.problem(key, found, allowed);
        self.leave(key);
    }

    /// Leaves the other values of the table unjudged in which `key` stands.
    fn leave(&mut self, key: &str) {
        let place = match key.rfind('.') {
            Some(dot) => &key[..dot],
            None => key.split('[').next().unwrap_or(key),
        };
        self.findings.unread.push(place.into());
    }

    /// Among the variants of a tagged enum, the one that the table names.
    fn tagged(&self, schema: &'a Json, value: &Value) -> &'a Json {
        let Some(table) = value.as_table() else { return schema };
        alternatives(schema)
            .into_iter()
            .map(|alternative| self.resolve(alternative))
            .find(|alternative| {
                alternative["properties"].as_object().into_iter().flatten().any(|(name, p)| {
                    p["const"].is_string()
                        && p["const"].as_str() == table.get(name).and_then(Value::as_str)
                })
            })
            .unwrap_or(schema)
    }

    /// The words of an enumeration of texts; empty where any text is allowed.
    fn words(&self, schema: &'a Json) -> Vec<&'a str> {
        if let Some(word) = schema["const"].as_str() {
            return vec![word];
        }
        let listed = schema["enum"].as_array().into_iter().flatten().filter_map(Json::as_str);
        let chosen = alternatives(schema).into_iter().flat_map(|a| self.words(self.resolve(a)));
        listed.chain(chosen).collect()
    }

    fn allowed(&self, schema: &'a Json) -> String {
        let words = self.words(schema);
        if !words.is_empty() {
            return format!("one of {}", words.join(", "));
        }
        let counts = [("minItems", "at least"), ("maxItems", "at most")];
        let bounds = [
            ("minimum", "≥"),
            ("exclusiveMinimum", ">"),
            ("maximum", "≤"),
            ("exclusiveMaximum", "<"),
        ];
        let limits = |names: &[(&str, &str)]| -> String {
            let limit =
                |(name, sign): &(&str, &str)| schema[*name].as_f64().map(|b| format!("{sign} {b}"));
            names.iter().filter_map(limit).collect::<Vec<_>>().join(" and ")
        };
        let text = match kind(schema) {
            "object" => "a table".into(),
            "array" => {
                let item = self.allowed(self.resolve(&schema["items"]));
                match (schema["minItems"].as_u64(), schema["maxItems"].as_u64()) {
                    (Some(a), Some(b)) if a == b => format!("a list of {a}, each {item}"),
                    _ => format!("a list of {}, each {item}", limits(&counts))
                        .replace("of ,", "of any length,"),
                }
            }
            "number" => format!("a finite number {}", limits(&bounds)),
            "integer" => format!("an integer {}", limits(&bounds)),
            "boolean" => "true or false".into(),
            "string" => "a text".into(),
            _ => self.variants(schema),
        };
        text.trim_end().into()
    }

    /// The tags of a tagged enum, key and word.
    fn tags(&self, schema: &'a Json) -> Vec<(&'a str, &'a str)> {
        let tags = alternatives(schema).into_iter().flat_map(|a| {
            let properties = self.resolve(a)["properties"].as_object();
            properties
                .into_iter()
                .flatten()
                .filter_map(|(name, p)| p["const"].as_str().map(|word| (name.as_str(), word)))
        });
        tags.collect()
    }

    /// The tags of a tagged enum in words.
    fn variants(&self, schema: &'a Json) -> String {
        let tags = self.tags(schema).into_iter();
        let tags: Vec<_> = tags.map(|(name, word)| format!("{name} = \"{word}\"")).collect();
        format!("a table with one of {}", tags.join(", "))
    }

    /// A value that fits the schema, to stand for one that could not be read.
    fn placeholder(&self, schema: &'a Json) -> Value {
        let schema = self.resolve(schema);
        if let Some(word) = self.words(schema).first() {
            return Value::String((*word).into());
        }
        match kind(schema) {
            "array" => {
                let count = schema["minItems"].as_u64().unwrap_or(0);
                Value::Array((0..count).map(|_| self.placeholder(&schema["items"])).collect())
            }
            "number" => Value::Float(1.0),
            "integer" => Value::Integer(1),
            "boolean" => Value::Boolean(false),
            "string" => Value::String(String::new()),
            _ => {
                let first = alternatives(schema).first().map_or(schema, |a| self.resolve(a));
                let required = first["required"].as_array().into_iter().flatten();
                let entry = |name: &'a str| {
                    (name.to_string(), self.placeholder(&first["properties"][name]))
                };
                Value::Table(required.filter_map(Json::as_str).map(entry).collect())
            }
        }
    }
}

/// Whether a number is finite and within the bounds of its schema.
fn inside(schema: &Json, x: f64) -> bool {
    let bound = |name: &str| schema[name].as_f64();
    x.is_finite()
        && bound("minimum").is_none_or(|b| x >= b)
        && bound("exclusiveMinimum").is_none_or(|b| x > b)
        && bound("maximum").is_none_or(|b| x <= b)
        && bound("exclusiveMaximum").is_none_or(|b| x < b)
}

/// The alternatives of a schema but `null`.
fn alternatives(schema: &Json) -> Vec<&Json> {
    let lists = [&schema["oneOf"], &schema["anyOf"]];
    let all = lists.into_iter().filter_map(Json::as_array).flatten();
    all.filter(|alternative| alternative["type"] != "null").collect()
}

/// The JSON type of a schema, `null` left out; empty for a tagged enum.
fn kind(schema: &Json) -> &str {
    let texts = alternatives(schema).iter().any(|a| kind(a) == "string");
    match &schema["type"] {
        Json::String(name) => name,
        Json::Array(names) => {
            names.iter().filter_map(Json::as_str).find(|n| *n != "null").unwrap_or("")
        }
        _ if texts => "string",
        _ => "",
    }
}

fn describe(value: &Value) -> String {
    match value {
        Value::String(text) => format!("text \"{text}\""),
        Value::Integer(n) => format!("integer {n}"),
        Value::Float(x) => format!("number {x}"),
        Value::Boolean(b) => format!("{b}"),
        Value::Datetime(d) => format!("date {d}"),
        Value::Array(items) => format!("a list of {}", items.len()),
        Value::Table(_) => "a table".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Deserialize;

    #[derive(Debug, Deserialize, JsonSchema, PartialEq)]
    #[serde(deny_unknown_fields)]
    struct Part {
        #[schemars(extend("exclusiveMinimum" = 0))]
        mass_kg: f64,
        direction: [f64; 3],
        #[serde(default)]
        shape: Option<Shape>,
        law: Option<Law>,
    }

    #[derive(Debug, Deserialize, JsonSchema, PartialEq)]
    #[serde(rename_all = "kebab-case")]
    enum Shape {
        /// Round.
        Round,
        /// With four equal sides.
        FourSided,
    }

    #[derive(Debug, Deserialize, JsonSchema, PartialEq)]
    #[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
    enum Law {
        /// A constant.
        Fixed { value: f64 },
        /// Between two bounds.
        Uniform { low: f64, high: f64 },
    }

    #[derive(Debug, Deserialize, JsonSchema, PartialEq)]
    #[serde(deny_unknown_fields)]
    struct File {
        name: String,
        #[serde(default)]
        cases: u64,
        part: Vec<Part>,
    }

    fn problems(text: &str) -> Vec<(String, String, String)> {
        let result = read::<File>("f.toml", text).and_then(|(raw, f)| f.finish(Some(raw)));
        let list = result.expect_err("a problem").0;
        list.into_iter().map(|p| (p.key, p.found, p.allowed)).collect()
    }

    const GOOD: &str = "name = \"a\"\n[[part]]\nmass_kg = 3\ndirection = [1, 0.5, 0]\n\
        shape = \"four-sided\"\nlaw = { kind = \"uniform\", low = 0, high = 1 }\n";

    #[test]
    fn a_good_file_is_read() {
        let (raw, findings) = read::<File>("f.toml", GOOD).unwrap();
        let file = findings.finish(Some(raw)).unwrap();
        assert_eq!(file.part[0].direction, [1.0, 0.5, 0.0]);
        assert_eq!(file.part[0].shape, Some(Shape::FourSided));
        assert_eq!(file.part[0].law, Some(Law::Uniform { low: 0.0, high: 1.0 }));
    }

    #[test]
    fn every_problem_is_found_with_its_key_path() {
        let found = problems(
            "cases = -1\ncolour = 3\n[[part]]\nmas_kg = -2.0\ndirection = [1, \"y\", inf]\n\
             shape = \"four-side\"\n[[part]]\nmass_kg = \"heavy\"\ndirection = [1]\n\
             law = { kind = \"unifrom\", low = 0 }\n[[part]]\nmass_kg = nan\ndirection = 1\n\
             law = { kind = \"uniform\", low = 0, hihg = true }\n",
        );
        let keys: Vec<&str> = found.iter().map(|p| p.0.as_str()).collect();
        assert_eq!(
            keys,
            [
                "colour",
                "cases",
                "part[0].mas_kg",
                "part[0].direction[1]",
                "part[0].direction[2]",
                "part[0].mass_kg",
                "part[0].shape",
                "part[1].direction",
                "part[1].law.kind",
                "part[1].mass_kg",
                "part[2].direction",
                "part[2].law.hihg",
                "part[2].law.high",
                "part[2].mass_kg",
                "name",
            ]
        );
        assert!(found[2].2.contains("did you mean `mass_kg`?"), "{:?}", found[2]);
        assert!(found[6].2.contains("did you mean `four-sided`?"), "{:?}", found[6]);
        assert_eq!(found[3].1, "text \"y\"");
        assert_eq!(found[5].2, "a finite number > 0");
        assert_eq!(found[7].2, "a list of 3, each a finite number");
        assert_eq!(found[8].1, "\"unifrom\"");
        assert!(found[8].2.contains("did you mean `uniform`?"), "{:?}", found[8]);
        assert_eq!(found[14].1, "nothing");
    }

    #[test]
    fn a_table_with_an_unread_value_is_not_judged_further_but_others_are() {
        let text = "name = \"a\"\n[[part]]\nmass_kg = \"x\"\ndirection = [1, 0, 0]\n[[part]]\nmass_kg = 1\ndirection = [1, 0, 0]\n";
        let (raw, mut findings) = read::<File>("f.toml", text).unwrap();
        findings.push("part[0].direction", "follows", "not listed");
        findings.push("part[1].direction", "own", "listed");
        let list = findings.finish(Some(raw)).unwrap_err().0;
        let keys: Vec<&str> = list.iter().map(|p| p.key.as_str()).collect();
        assert_eq!(keys, ["part[0].mass_kg", "part[1].direction"]);
    }

    #[test]
    fn text_that_is_not_toml_names_the_line() {
        let list = read::<File>("f.toml", "name = \"a\"\ncases = = 3\n").unwrap_err().0;
        assert_eq!((list.len(), list[0].key.as_str()), (1, "line 2"));
    }

    proptest::proptest! {
        #[test]
        fn no_text_makes_the_reader_panic(text in "[a-z_=\\[\\]{}\"0-9.\\-\n ]{0,80}") {
            let _ = read::<File>("f.toml", &text);
        }

        #[test]
        fn no_value_in_any_place_makes_the_reader_panic(
            place in 0_usize..8,
            junk in proptest::sample::select(vec!["1", "-1.5", "nan", "\"\"", "[]", "{}", "true", "[[]]", "{ kind = 1 }", "1979-05-27"]),
        ) {
            let keys = ["name", "cases", "part", "part[0].mass_kg", "direction", "shape", "law", "kind"];
            let text = if place < 3 {
                format!("{} = {junk}", keys[place])
            } else {
                format!("name = \"a\"\n[[part]]\n{} = {junk}\n", keys[place].trim_start_matches("part[0]."))
            };
            let _ = read::<File>("f.toml", &text).and_then(|(raw, f)| f.finish(Some(raw)));
        }
    }
}
