//! Reports: from values to text for people.
