//! The measuring loop.

use super::Meter;
use crate::{failure::Failure, record::Sample};

/// A solve that takes more milliseconds is slow. All rounds of it would take too long, and it needs fewer, because
/// short disturbances average out within a long solve.
pub const SLOW_MS: f64 = 5000.0;

/// Rounds of a slow contestant: the fewest that have a median and a range.
pub const SLOW_ROUNDS: u32 = 3;

/// Assumed nanoseconds per message entry, to guess which contestants are slow before their first solve.
const GUESSED_NS: f64 = 2.5;

/// A participant in the loop.
pub trait Contestant {
    /// Prepares and warms up before the first round. Returns the sample of the warm-up, which is not one of the rounds.
    fn warm_up(&mut self, meter: &Meter<'_>) -> Result<Sample, Failure> {
        self.turn(0, meter)
    }

    /// Takes one turn.
    fn turn(&mut self, round: u32, meter: &Meter<'_>) -> Result<Sample, Failure>;

    /// Keeps the result of a turn. A failure here, such as a full disk, ends the loop.
    fn keep(&mut self, _taken: Result<&Sample, &Failure>) -> Result<(), Failure> {
        Ok(())
    }

    /// Message entries per turn, the unit of progress.
    fn entries(&self) -> u64 {
        1
    }
}

/// Anything that returns a sample: a loop that copies memory, or another program.
impl<F: FnMut(u32) -> Result<Sample, Failure>> Contestant for F {
    fn turn(&mut self, round: u32, _: &Meter<'_>) -> Result<Sample, Failure> {
        self(round)
    }
}

/// A contestant and the results of its turns.
pub struct Entrant<C> {
    /// Its name in progress and messages.
    pub name: String,
    /// The contestant.
    pub contestant: C,
    /// Time of its first solve.
    pub first_ms: Option<f64>,
    /// Every sample, by round.
    pub samples: Vec<Sample>,
    /// Why it takes no more turns.
    pub failure: Option<Failure>,
}

/// The rules of the loop.
#[derive(Clone, Copy, Debug)]
pub struct Rules {
    /// Rounds, in each of which every contestant takes one turn.
    pub rounds: u32,
    /// Rounds of a contestant whose first solve is slow, see [`SLOW_MS`].
    pub slow_rounds: u32,
    /// Whether contestants warm up before the first round. If they do not, each turn prepares everything anew.
    pub warm_up: bool,
    /// Whether one failure ends everything. If not, the contestant that failed takes no more turns.
    pub fail_fast: bool,
}

impl Rules {
    /// Rounds of a contestant whose first solve took `first_ms`.
    pub fn rounds_for(&self, first_ms: f64) -> u32 {
        if first_ms > SLOW_MS { self.rounds.min(self.slow_rounds) } else { self.rounds }
    }
}

impl<C: Contestant> Entrant<C> {
    /// A contestant without samples.
    pub fn new(name: String, contestant: C) -> Self {
        Self { name, contestant, first_ms: None, samples: Vec::new(), failure: None }
    }

    /// The contestant, resumed with the samples of an interrupted run.
    pub fn resumed(self, samples: &[Sample]) -> Self {
        Self { first_ms: samples.first().map(|sample| sample.total_ms), samples: samples.to_vec(), ..self }
    }

    fn rounds(&self, rules: &Rules) -> u32 {
        rules.rounds_for(self.first_ms.unwrap_or(self.contestant.entries() as f64 * GUESSED_NS / 1e6))
    }

    fn takes_part(&self, round: u32, rules: &Rules) -> bool {
        self.failure.is_none() && self.samples.len() as u32 == round && round < self.rounds(rules)
    }

    /// Remaining message entries.
    fn left(&self, rules: &Rules) -> u64 {
        let warm_up = u32::from(rules.warm_up && self.first_ms.is_none());
        let turns = (warm_up + self.rounds(rules)).saturating_sub(self.samples.len() as u32);
        if self.failure.is_some() { 0 } else { u64::from(turns) * self.contestant.entries() }
    }

    /// Takes a turn, or warms up if `round` is `None`.
    fn take(&mut self, round: Option<u32>, rules: &Rules, meter: &mut Meter<'_>) -> Result<(), Failure> {
        let taken = match round {
            Some(round) => self.contestant.turn(round, meter),
            None => self.contestant.warm_up(meter),
        };
        match taken {
            Err(failure) if failure.is_interrupted() || rules.fail_fast => return Err(failure),
            Err(failure) => {
                meter.line(&format!("{:<29} {failure}", self.name));
                self.contestant.keep(Err(&failure))?;
                self.failure = Some(failure);
            }
            Ok(sample) => {
                meter.add(self.contestant.entries());
                self.first_ms.get_or_insert(sample.total_ms);
                if round.is_some() {
                    self.contestant.keep(Ok(&sample))?;
                    self.samples.push(sample);
                }
            }
        }
        Ok(())
    }
}

/// Runs the loop. In each round every contestant takes one turn, one after another.
pub fn take_turns<C: Contestant>(
    entrants: &mut [Entrant<C>],
    rules: &Rules,
    meter: &mut Meter<'_>,
) -> Result<(), Failure> {
    meter.add(entrants.iter().map(|entrant| entrant.samples.len() as u64 * entrant.contestant.entries()).sum());
    let warm_up = rules.warm_up.then_some(None);
    for round in warm_up.into_iter().chain((0..rules.rounds).map(Some)) {
        for index in 0..entrants.len() {
            let left = entrants.iter().map(|entrant| entrant.left(rules)).sum();
            let entrant = &mut entrants[index];
            if round.is_some_and(|round| !entrant.takes_part(round, rules)) {
                continue;
            }
            let which = round.map(|round| format!(", round {} of {}", round + 1, entrant.rounds(rules)));
            meter.begin(&(entrant.name.clone() + &which.unwrap_or_default()), left)?;
            entrant.take(round, rules, meter)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;

    use super::*;
    use bp_stereo::{Event, Stop, Watch};

    const RULES: Rules = Rules { rounds: 3, slow_rounds: 2, warm_up: false, fail_fast: false };

    fn sample(round: u32, total_ms: f64) -> Sample {
        Sample { round, total_ms, ..Sample::default() }
    }

    /// A contestant of a test: its name, and how long it takes in a round.
    struct Fake<'a> {
        name: &'a str,
        ms: &'a dyn Fn(u32) -> Result<f64, Failure>,
    }

    fn a(ms: &dyn Fn(u32) -> Result<f64, Failure>) -> Fake<'_> {
        Fake { name: "a", ms }
    }

    fn b(ms: &dyn Fn(u32) -> Result<f64, Failure>) -> Fake<'_> {
        Fake { name: "b", ms }
    }

    /// Runs the loop with them. Returns who took turns, in order, and how it ended.
    fn turns(rules: &Rules, all: &[Fake<'_>], watch: &Watch<'_>) -> String {
        let taken = RefCell::new(String::new());
        let mut entrants = Vec::new();
        for Fake { name, ms } in all {
            let turn = |round| {
                *taken.borrow_mut() += name;
                ms(round).map(|ms| sample(round, ms))
            };
            entrants.push(Entrant::new((*name).to_owned(), turn));
        }
        let ended = take_turns(&mut entrants, rules, &mut Meter::new(watch));
        let counts: Vec<_> = entrants.iter().map(|entrant| entrant.samples.len().to_string()).collect();
        let ended = ended.map_or_else(|failure| failure.to_string(), |()| counts.join(" "));
        drop(entrants);
        format!("{}: {ended}", taken.into_inner())
    }

    #[test]
    fn everybody_takes_one_turn_a_round_and_the_slow_take_fewer() {
        let (fast, slow) = (|_| Ok(1.0), |_| Ok(SLOW_MS + 1.0));
        assert_eq!(
            turns(&RULES, &[a(&fast), b(&slow), Fake { name: "c", ms: &fast }], &Watch::default()),
            "abcabcac: 3 2 3"
        );
        let rules = Rules { warm_up: true, ..RULES };
        assert_eq!(turns(&rules, &[a(&fast), b(&slow)], &Watch::default()), "abababa: 3 2");
    }

    #[test]
    fn whoever_fails_takes_no_more_turns_or_ends_all_of_them() {
        let fails = |round| if round == 1 { Err(Failure::other("no")) } else { Ok(1.0) };
        let all = [a(&fails), b(&|_| Ok(1.0))];
        assert_eq!(turns(&RULES, &all, &Watch::default()), "ababb: 1 3");
        assert_eq!(turns(&Rules { fail_fast: true, ..RULES }, &all, &Watch::default()), "aba: no");
        let disk = |_: u32| Err(Failure::interrupted());
        assert_eq!(turns(&RULES, &[a(&disk)], &Watch::default()), "a: interrupted");
    }

    #[test]
    fn a_run_stops_between_two_turns_and_knows_how_far_it_has_come() {
        let (stop, seen) = (Stop::default(), std::sync::Mutex::new(Vec::new()));
        let events = |event: Event<'_>| {
            if let Event::Progress { done, total } = event {
                seen.lock().unwrap().push((done, total));
            }
        };
        let stops = |round| {
            if round == 1 {
                stop.stop();
            }
            Ok(1.0)
        };
        let ended = turns(&RULES, &[a(&stops), b(&|_| Ok(1.0))], &Watch::new(&events, &stop));
        assert_eq!(ended, "aba: interrupted");
        assert_eq!(*seen.lock().unwrap(), [(0, 6), (1, 6), (2, 6)]);
    }

    #[test]
    fn an_interrupted_run_goes_on_where_it_was() {
        let rounds = RefCell::new(Vec::new());
        let contestant = |round| {
            rounds.borrow_mut().push(round);
            Ok(sample(round, 1.0))
        };
        let mut entrants = [Entrant::new("a".to_owned(), contestant).resumed(&[sample(0, 1.0)])];
        take_turns(&mut entrants, &RULES, &mut Meter::new(&Watch::default())).unwrap();
        assert_eq!((rounds.borrow().as_slice(), entrants[0].samples.len()), (&[1, 2][..], 3));
    }
}
