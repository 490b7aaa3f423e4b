//! Diagrams that the thesis has no counterpart of: what every plan costs on every backend, and what it gives for that.

use bp_charts::{Axis, Key, Line, Plot, Point, Series, Style, Value, number};

use super::{
    Drawing,
    format::mebibytes,
    legend,
    results::Results,
    tables::{Named, Table, ours::all_plans},
};
use crate::{
    failure::Failure,
    record::{Measurement, Settings},
    summary::{Group, groups, interval, mean, mean_of_medians, samples},
};

/// A plan on a backend, with numbers of every scene.
struct Entrant<'a> {
    /// Its places among the plans and among the devices.
    plan: usize,
    backend: usize,
    /// From images to labels, in milliseconds, with a 95 % interval where there are samples enough.
    ms: Value,
    settings: &'a Settings,
    measured: Vec<&'a Measurement>,
}

/// What stands against time.
struct Quantity {
    title: String,
    axis: Axis,
    value: fn(&Measurement) -> f64,
    /// What a reader must know.
    note: &'static str,
    /// Whether it means the same of a plan as of others in the diagram.
    compares: Box<dyn Fn(&Settings) -> bool>,
}

/// What all plans and backends have in common.
struct Field<'a> {
    results: &'a Results<'a>,
    plans: Vec<Named>,
    entrants: Vec<Entrant<'a>>,
}

/// All diagrams, in order.
pub(super) fn all(results: &Results<'_>) -> Result<Vec<Drawing>, Failure> {
    let field = Field::new(results);
    let quantities = [error(), memory()].into_iter().chain(energies(&field.entrants));
    quantities.enumerate().map(|(i, quantity)| Diagram::new(&field, &quantity).drawing(i + 1)).collect()
}

fn error() -> Quantity {
    Quantity {
        title: "Error against time".to_owned(),
        axis: Axis::linear("visible pixels wrong by more than 1 px, %"),
        value: |measured| measured.visible.bad[1],
        note: "Backends give the same labels, so that those of a plan stand in a row.",
        compares: Box::new(|_| true),
    }
}

fn memory() -> Quantity {
    Quantity {
        title: "Memory against time".to_owned(),
        axis: Axis::logarithmic("MiB allocated"),
        value: |measured| mebibytes(measured.allocated_bytes),
        note: "Bytes allocated, counted.",
        compares: Box::new(|_| true),
    }
}

/// One quantity for all plans whose labels have the same energy.
fn energies(entrants: &[Entrant<'_>]) -> Vec<Quantity> {
    type Model = (String, usize, i32, u8, u8);
    fn model(s: &Settings) -> Model {
        (s.profile.clone(), s.labels, s.min_disparity, s.slope, s.truncation)
    }
    let mut models: Vec<Model> = Vec::new();
    for own in entrants.iter().map(|entrant| model(entrant.settings)) {
        if !models.contains(&own) {
            models.push(own);
        }
    }
    let quantity = |own: Model| Quantity {
        title: format!(
            "Energy against time: profile {}, L = {} from {} px, slope {}, K = {}",
            own.0, own.1, own.2, own.3, own.4
        ),
        axis: Axis::logarithmic("energy / 1000"),
        value: |measured| measured.energy.total as f64 / 1000.0,
        note: "Only plans of this profile: its energies and those of another are not of one scale.",
        compares: Box::new(move |settings| model(settings) == own),
    };
    models.into_iter().map(quantity).collect()
}

impl<'a> Field<'a> {
    fn new(results: &'a Results<'a>) -> Self {
        let (plans, devices) = (all_plans(results), results.devices());
        let entrant = |group: &Group<'a>| {
            let measured = group.whole()?;
            let ms = samples(&measured, |sample| sample.total_ms);
            let value = mean_of_medians(&ms)?;
            let [low, high] = interval(&ms).unwrap_or([value; 2]);
            Some(Entrant {
                plan: plans.iter().position(|plan| plan.plan == group.plan)?,
                backend: devices.iter().position(|(backend, _)| *backend == group.backend)?,
                ms: Value { value, low: low.min(value), high: high.max(value) },
                settings: &group.cell()?.settings,
                measured,
            })
        };
        let entrants = groups(results.record).iter().filter_map(entrant).collect();
        Self { results, plans, entrants }
    }

    fn label(&self, entrant: &Entrant<'_>) -> String {
        self.results.label(self.results.devices()[entrant.backend].0)
    }

    fn name(&self, entrant: &Entrant<'_>) -> String {
        format!("{} on {}", short(&self.plans[entrant.plan]), self.label(entrant))
    }
}

/// A quantity of all entrants that it compares.
struct Diagram<'a> {
    field: &'a Field<'a>,
    quantity: &'a Quantity,
    entrants: Vec<&'a Entrant<'a>>,
    /// One an entrant.
    points: Vec<Point>,
    /// Numbers of the points that nothing beats.
    front: Vec<usize>,
}

impl<'a> Diagram<'a> {
    fn new(field: &'a Field<'a>, quantity: &'a Quantity) -> Self {
        let entrants: Vec<_> = field.entrants.iter().filter(|entrant| (quantity.compares)(entrant.settings)).collect();
        let point = |entrant: &&Entrant<'_>| Point::new(entrant.ms, mean(&entrant.measured, quantity.value));
        let points: Vec<_> = entrants.iter().map(point).collect();
        Self { field, quantity, entrants, front: front(&points), points }
    }

    fn drawing(&self, number: usize) -> Result<Drawing, Failure> {
        let svg = self.chart().svg().map_err(|error| Failure::other(format!("diagram A.{number}: {error}")))?;
        let caption = [Some(READING.to_owned()), Some(self.quantity.note.to_owned()), Some(self.members())];
        let names = [self.short_names(), self.field.results.unavailable()];
        Ok(Drawing {
            name: format!("diagram-A.{number}"),
            title: format!("Diagram A.{number} (ours): {}", self.quantity.title),
            caption: caption.into_iter().chain(names).flatten().collect::<Vec<_>>().join(" "),
            svg,
            table: Some(self.table()),
        })
    }

    /// Who is on the front, in a sentence.
    fn members(&self) -> String {
        let members: Vec<_> = self.front.iter().map(|&i| self.field.name(self.entrants[i])).collect();
        if members.is_empty() {
            return "No plan has numbers of every scene.".to_owned();
        }
        format!("Pareto front, nothing else being both faster and lower: {}.", members.join("; "))
    }

    fn chart(&self) -> Plot {
        let Self { field, quantity, .. } = self;
        let (results, title) = (field.results, &quantity.title);
        let stairs = Series {
            name: "Pareto front".to_owned(),
            style: Style::line(GREY, Line::Stairs),
            points: self.front.iter().map(|&i| self.points[i]).collect(),
        };
        let front = Key { name: stairs.name.clone(), style: stairs.style };
        let plans = self.plans().map(|(i, plan)| (i, short(plan)));
        let point = |(entrant, &point): (&&Entrant<'_>, &Point)| Series {
            name: field.name(entrant),
            style: legend::style(entrant.plan, entrant.backend),
            points: vec![point],
        };
        let points = self.entrants.iter().zip(&self.points).map(point);
        let (data, members) = (results.data(), self.members());
        Plot {
            title: title.clone(),
            description: format!("{title}, means over {data}, of every plan on every backend. {members}"),
            x: Axis::logarithmic("milliseconds from images to labels"),
            y: Axis { name: format!("{}; {}", quantity.axis.name, results.setting()), ..quantity.axis.clone() },
            levels: Vec::new(),
            keys: legend::keys(results, plans).into_iter().chain([front]).collect(),
            series: [stairs].into_iter().chain(points).collect(),
        }
    }

    /// A row an entrant.
    fn table(&self) -> Table {
        let rows = self.entrants.iter().zip(&self.points).map(|(entrant, Point { x, y })| {
            let range = format!("{} ({} to {})", number(x.value, 1), number(x.low, 1), number(x.high, 1));
            let ms = if x.low < x.high { range } else { number(x.value, 1) };
            vec![short(&self.field.plans[entrant.plan]), self.field.label(entrant), ms, number(y.value, 2)]
        });
        let columns = ["plan", "backend", "total, ms", &self.quantity.axis.name];
        Table::new("", self.field.results.setting(), &columns).rows(rows.collect::<Vec<_>>())
    }

    /// The plans that are shown, with their places among all.
    fn plans(&self) -> impl Iterator<Item = (usize, &Named)> {
        let is_shown = |plan: usize| self.entrants.iter().any(|entrant| entrant.plan == plan);
        self.field.plans.iter().enumerate().filter(move |&(i, _)| is_shown(i))
    }

    /// What the short names of our plans mean.
    fn short_names(&self) -> Option<String> {
        let meaning = |plan: &Named| format!("\"{}\" is {}", short(plan), plan.title.trim_start_matches("ours: "));
        let own = self.plans().filter(|(_, plan)| plan.printed.is_none());
        let names: Vec<_> = own.map(|(_, plan)| meaning(plan)).collect();
        (!names.is_empty()).then(|| format!("{}.", names.join("; ")))
    }
}

/// The colour of the front.
const GREY: usize = 7;

/// How to read all of these diagrams.
const READING: &str = "Lower left is better. Means over the scenes; times are medians by the wall clock, whiskers 95 % \
                       intervals (bootstrap) where every scene has three samples or more.";

/// A plan's name in a legend: titles of ours tell their settings.
fn short(plan: &Named) -> String {
    if plan.printed.is_some() { plan.title.to_owned() } else { format!("ours: {}", plan.plan) }
}

/// Numbers of the points that no other is below without being right of them, from left to right.
fn front(points: &[Point]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..points.len()).collect();
    let place = |i: usize| (points[i].x.value, points[i].y.value);
    order.sort_by(|&a, &b| place(a).0.total_cmp(&place(b).0).then(place(a).1.total_cmp(&place(b).1)));
    let mut least = f64::INFINITY;
    order.retain(|&i| {
        let is_lower = place(i).1 < least;
        least = least.min(place(i).1);
        is_lower
    });
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_front_holds_what_nothing_beats_in_both() {
        let points = [(3.0, 2.0), (1.0, 9.0), (2.0, 9.0), (2.0, 4.0), (9.0, 1.0), (4.0, 2.0), (1.0, 9.5)];
        assert_eq!(front(&points.map(|(x, y)| Point::new(x, y))), [1, 3, 0, 4]);
        assert!(front(&[]).is_empty());
    }
}
