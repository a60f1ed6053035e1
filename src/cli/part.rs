//! Which part of a campaign a process is to evaluate: as the user says, or as the scheduler that
//! started it says in its environment.

use crate::campaign::pool::Part;

/// Most parts of a campaign.
const MOST: u64 = 1_000_000;

/// Reads `i/n`.
///
/// # Errors
/// What is allowed.
pub fn parse(text: &str) -> Result<Part, String> {
    let allowed = || format!("i/n with 1 ≤ i ≤ n ≤ {MOST}, for instance 3/8");
    let numbers = text.split_once('/').and_then(|(i, n)| Some((number(i)?, number(n)?)));
    match numbers {
        Some((number, of)) if (1..=of).contains(&number) && of <= MOST => Ok(Part { number, of }),
        _ => Err(allowed()),
    }
}

fn number(text: &str) -> Option<u64> {
    text.trim().parse().ok()
}

/// A scheduler of job arrays.
struct Scheduler {
    name: &'static str,
    /// Variable with the index of the task.
    index: &'static str,
    /// Variables with the first and the last index of the array, where there are any.
    first: Option<&'static str>,
    last: Option<&'static str>,
    /// First index by the scheduler's custom.
    base: u64,
}

const SCHEDULERS: [Scheduler; 6] = [
    Scheduler {
        name: "Slurm",
        index: "SLURM_ARRAY_TASK_ID",
        first: Some("SLURM_ARRAY_TASK_MIN"),
        last: Some("SLURM_ARRAY_TASK_MAX"),
        base: 1,
    },
    Scheduler { name: "PBS", index: "PBS_ARRAY_INDEX", first: None, last: None, base: 1 },
    Scheduler { name: "Torque", index: "PBS_ARRAYID", first: None, last: None, base: 1 },
    Scheduler {
        name: "Kubernetes",
        index: "JOB_COMPLETION_INDEX",
        first: None,
        last: None,
        base: 0,
    },
    Scheduler {
        name: "SGE",
        index: "SGE_TASK_ID",
        first: Some("SGE_TASK_FIRST"),
        last: Some("SGE_TASK_LAST"),
        base: 1,
    },
    Scheduler {
        name: "LSF",
        index: "LSB_JOBINDEX",
        first: None,
        last: Some("LSB_JOBINDEX_END"),
        base: 1,
    },
];

/// The part that the environment `get` names. With `shards` that is the number of parts and indices
/// count from the scheduler's first, 1 or (Kubernetes) 0: so tasks may be submitted again one by
/// one. Without, it is what the scheduler says of the whole array.
///
/// # Errors
/// In words, what is missing or does not fit.
pub fn from_environment(
    get: impl Fn(&str) -> Option<String>,
    shards: Option<u64>,
) -> Result<Part, String> {
    // Outside an array LSF says 0 and SGE `undefined`.
    let present = |scheduler: &&Scheduler| {
        get(scheduler.index).is_some_and(|text| {
            text != "undefined" && !(scheduler.name == "LSF" && text.trim() == "0")
        })
    };
    let Some(scheduler) = SCHEDULERS.iter().find(present) else {
        let names: Vec<&str> = SCHEDULERS.iter().map(|scheduler| scheduler.index).collect();
        return Err(format!("found none of {}: this is no task of an array", names.join(", ")));
    };
    let read = |name: &str| -> Result<u64, String> {
        let text = get(name).ok_or_else(|| format!("{name} is not set"))?;
        number(&text).ok_or_else(|| format!("{name}: found {text:?}; allowed: a number"))
    };
    let index = read(scheduler.index)?;
    let (first, of) = match (shards, scheduler.last) {
        (Some(shards), _) => (scheduler.base, shards),
        (None, Some(last)) => {
            let first = scheduler.first.map_or(Ok(scheduler.base), &read)?;
            let last = read(last)?;
            let of = last.checked_sub(first).map_or(0, |steps| steps + 1);
            // Tasks submitted one by one, or in steps, are not the whole array.
            if let Some(count) = get("SLURM_ARRAY_TASK_COUNT").and_then(|text| number(&text))
                && scheduler.name == "Slurm"
                && count != of
            {
                return Err(format!("{count} tasks from {first} to {last}: say --shards N"));
            }
            (first, of)
        }
        (None, None) => {
            return Err(format!("{} does not say how many tasks: say --shards N", scheduler.name));
        }
    };
    let number = (index + 1).checked_sub(first).filter(|number| (1..=of).contains(number));
    match number {
        Some(number) if of <= MOST => Ok(Part { number, of }),
        _ => {
            let (name, last) = (scheduler.index, (first + of).saturating_sub(1));
            Err(format!("{name}: found {index}; allowed: {first} to {last}"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(variables: &[(&str, &str)], shards: Option<u64>) -> Result<(u64, u64), String> {
        let get = |name: &str| {
            let found = variables.iter().find(|(known, _)| *known == name);
            found.map(|(_, value)| (*value).to_owned())
        };
        from_environment(get, shards).map(|part| (part.number, part.of))
    }

    #[test]
    fn a_part_is_written_as_one_number_of_another() {
        assert_eq!(parse("3/8"), Ok(Part { number: 3, of: 8 }));
        for wrong in ["0/8", "9/8", "3", "a/b", "-1/3", "1/0", "1/9999999999", "1/2/3", ""] {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn every_scheduler_says_which_task_it_started() {
        let slurm = [
            ("SLURM_ARRAY_TASK_ID", "2"),
            ("SLURM_ARRAY_TASK_MIN", "0"),
            ("SLURM_ARRAY_TASK_MAX", "3"),
            ("SLURM_ARRAY_TASK_COUNT", "4"),
        ];
        assert_eq!(part(&slurm, None), Ok((3, 4)));
        let sge = [("SGE_TASK_ID", "4"), ("SGE_TASK_FIRST", "1"), ("SGE_TASK_LAST", "9")];
        assert_eq!(part(&sge, None), Ok((4, 9)));
        assert_eq!(part(&[("LSB_JOBINDEX", "1"), ("LSB_JOBINDEX_END", "5")], None), Ok((1, 5)));
        assert_eq!(part(&[("PBS_ARRAY_INDEX", "7")], Some(8)), Ok((7, 8)));
        assert_eq!(part(&[("PBS_ARRAYID", "8")], Some(8)), Ok((8, 8)));
        assert_eq!(part(&[("JOB_COMPLETION_INDEX", "0")], Some(8)), Ok((1, 8)));
    }

    #[test]
    fn a_task_that_is_submitted_again_alone_keeps_its_number() {
        let alone = [
            ("SLURM_ARRAY_TASK_ID", "3"),
            ("SLURM_ARRAY_TASK_MIN", "3"),
            ("SLURM_ARRAY_TASK_MAX", "5"),
            ("SLURM_ARRAY_TASK_COUNT", "2"),
        ];
        assert_eq!(part(&alone, Some(8)), Ok((3, 8)));
        assert!(part(&alone, None).unwrap_err().contains("--shards"));
    }

    #[test]
    fn what_is_missing_or_does_not_fit_is_said() {
        assert!(part(&[], Some(4)).unwrap_err().contains("SLURM_ARRAY_TASK_ID"));
        assert!(part(&[("SGE_TASK_ID", "undefined")], Some(4)).is_err());
        assert!(part(&[("LSB_JOBINDEX", "0")], Some(4)).is_err());
        assert!(part(&[("PBS_ARRAY_INDEX", "1")], None).unwrap_err().contains("--shards"));
        assert!(part(&[("PBS_ARRAY_INDEX", "0")], Some(4)).unwrap_err().contains("1 to 4"));
        assert!(part(&[("JOB_COMPLETION_INDEX", "4")], Some(4)).unwrap_err().contains("0 to 3"));
        assert!(part(&[("JOB_COMPLETION_INDEX", "x")], Some(4)).unwrap_err().contains("a number"));
    }
}
