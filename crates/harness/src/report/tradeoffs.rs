//! Diagrams that are not in the thesis: error, memory and energy against time, for every plan on every backend.

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

/// A plan on a backend, with numbers for every scene.
struct Entrant<'a> {
    plan: Named,
    /// Its backend's place among the devices.
    backend: usize,
    /// Milliseconds from images to labels, with a 95 % interval if there are enough samples.
    ms: Value,
    settings: &'a Settings,
    measured: Vec<&'a Measurement>,
}

/// A quantity on the vertical axis; time is on the horizontal one.
struct Quantity {
    title: String,
    axis: Axis,
    value: fn(&Measurement) -> f64,
    /// How to read it.
    note: &'static str,
    /// Whether a plan with these settings belongs in the diagram.
    compares: Box<dyn Fn(&Settings) -> bool>,
}

/// All plans on all backends.
struct Field<'a> {
    results: &'a Results<'a>,
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
        axis: Axis::linear("non-occluded pixels wrong by more than 1 px, %"),
        value: |measured| measured.visible.bad[1],
        note: "All backends give the same labels, so all markers of a plan are at the same height.",
        compares: Box::new(|_| true),
    }
}

fn memory() -> Quantity {
    Quantity {
        title: "Memory against time".to_owned(),
        axis: Axis::logarithmic("MiB allocated"),
        value: |measured| mebibytes(measured.allocated_bytes),
        note: "Allocated bytes, as counted.",
        compares: Box::new(|_| true),
    }
}

/// A quantity for each energy function, since energies under different functions cannot be compared.
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
        note: "The diagram shows plans of this profile only, since energies of two profiles have different scales.",
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
                plan: *plans.iter().find(|plan| plan.plan == group.plan)?,
                backend: devices.iter().position(|(backend, _)| *backend == group.backend)?,
                ms: Value { value, low: low.min(value), high: high.max(value) },
                settings: &group.cell()?.settings,
                measured,
            })
        };
        let entrants = groups(results.record).iter().filter_map(entrant).collect();
        Self { results, entrants }
    }

    fn label(&self, entrant: &Entrant<'_>) -> String {
        self.results.label(self.results.devices()[entrant.backend].0)
    }

    fn name(&self, entrant: &Entrant<'_>) -> String {
        format!("{} on {}", entrant.plan.title, self.label(entrant))
    }
}

/// A quantity, and the entrants it is drawn for.
struct Diagram<'a> {
    field: &'a Field<'a>,
    quantity: &'a Quantity,
    entrants: Vec<&'a Entrant<'a>>,
    /// One for each entrant.
    points: Vec<Point>,
    /// Indices of the points on the Pareto front.
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
        let caption = [READING.to_owned(), self.quantity.note.to_owned(), self.members()];
        Ok(Drawing {
            name: format!("diagram-A.{number}"),
            title: format!("Diagram A.{number}: {}", self.quantity.title),
            caption: caption.into_iter().chain(self.field.results.unavailable()).collect::<Vec<_>>().join(" "),
            svg,
            table: Some(self.table()),
        })
    }

    /// The plans on the front, in a sentence.
    fn members(&self) -> String {
        let members: Vec<_> = self.front.iter().map(|&i| self.field.name(self.entrants[i])).collect();
        if members.is_empty() {
            return "No plan has numbers for every scene.".to_owned();
        }
        format!("On the Pareto front, where no other plan is both faster and lower: {}.", members.join("; "))
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
        let key = |plan: &Named| Key { name: plan.title.to_owned(), style: legend::any_device(results, plan) };
        let point = |(entrant, &point): (&&Entrant<'_>, &Point)| Series {
            name: field.name(entrant),
            style: legend::style(results, &entrant.plan, entrant.backend),
            points: vec![point],
        };
        let points = self.entrants.iter().zip(&self.points).map(point);
        let (data, members) = (results.data(), self.members());
        Plot {
            title: title.clone(),
            description: format!("{title}, means over {data}, for every plan on every backend. {members}"),
            x: Axis::logarithmic("milliseconds from images to labels"),
            y: Axis { name: format!("{}; {}", quantity.axis.name, results.setting()), ..quantity.axis.clone() },
            levels: Vec::new(),
            keys: self.plans().map(key).chain(legend::devices(results)).chain([front]).collect(),
            series: [stairs].into_iter().chain(points).collect(),
        }
    }

    /// A row for each entrant.
    fn table(&self) -> Table {
        let rows = self.entrants.iter().zip(&self.points).map(|(entrant, Point { x, y })| {
            let range = format!("{} ({} to {})", number(x.value, 1), number(x.low, 1), number(x.high, 1));
            let ms = if x.low < x.high { range } else { number(x.value, 1) };
            vec![entrant.plan.title.to_owned(), self.field.label(entrant), ms, number(y.value, 2)]
        });
        let columns = ["plan", "backend", "total, ms", &self.quantity.axis.name];
        Table::new("", self.field.results.setting(), &columns).rows(rows.collect::<Vec<_>>())
    }

    /// The plans that are shown, in the order of their markers.
    fn plans(&self) -> impl Iterator<Item = &Named> {
        let mut plans: Vec<_> = self.entrants.iter().map(|entrant| &entrant.plan).collect();
        plans.sort_by_key(|plan| plan.look);
        plans.dedup_by_key(|plan| plan.look);
        plans.into_iter()
    }
}

/// The colour of the front.
const GREY: usize = 7;

/// How to read all of these diagrams.
const READING: &str = "Lower left is better. Values are means over the scenes. Times are medians by the wall clock; whiskers \
                       are 95 % intervals (bootstrap), where every scene has at least three samples.";

/// Indices of the points that no other point beats in both values, from left to right.
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
