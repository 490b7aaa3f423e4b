//! A robust fit of a quadratic.

use std::{array, f64::consts::LN_2};

use super::{TERMS, moved::Moved, terms};
use crate::Size;

/// The fewest points that must agree, and the least share of all.
const LEAST_POINTS: usize = 40;
const LEAST_SHARE: f64 = 0.5;

/// Points farther from the fit than this many times the spread have no weight (Tukey's biweight).
const REJECTED: f64 = 4.685;

/// The spread of a normal distribution over the median of its absolute values.
const SPREAD_OF_MEDIAN: f64 = 1.4826;

/// Rounds of the fit.
const ROUNDS: usize = 10;

/// The spread is not taken to be smaller than this, in pixels.
const LEAST_SPREAD: f64 = 0.03;

/// Points agree if the spread is at most this, in pixels.
const LARGEST_SPREAD: f64 = 0.5;

/// The numbers of terms to choose from: none, a constant, a plane, a quadratic.
const CHOICES: [usize; 4] = [0, 1, 3, TERMS];

/// The terms at the place of a point, and the rows by which it moved.
struct Point {
    terms: [f64; TERMS],
    rows: f64,
    weight: f64,
}

impl Point {
    fn residual(&self, coefficients: &[f64; TERMS]) -> f64 {
        self.rows - self.terms.iter().zip(coefficients).map(|(term, coefficient)| term * coefficient).sum::<f64>()
    }
}

/// The normal equations of a weighted least-squares fit. The last column is the right side.
type Equations = [[f64; TERMS + 1]; TERMS];

/// The coefficients; `None` if too few points agree. Terms without a clear effect are left out.
pub(super) fn quadratic(size: Size, moved: &[Moved]) -> Option<[f64; TERMS]> {
    let mut points: Vec<Point> = moved
        .iter()
        .map(|moved| Point { terms: terms(size, moved.x, moved.y), rows: moved.rows, weight: moved.weight })
        .collect();
    let mut coefficients = [0.0; TERMS];
    coefficients[0] = median(moved.iter().map(|moved| moved.rows))?;
    let mut spread = f64::INFINITY;
    for _ in 0..ROUNDS {
        let residuals: Vec<f64> = points.iter().map(|point| point.residual(&coefficients)).collect();
        spread = (SPREAD_OF_MEDIAN * median(residuals.iter().map(|residual| residual.abs()))?).max(LEAST_SPREAD);
        for ((point, moved), residual) in points.iter_mut().zip(moved).zip(residuals) {
            let part = residual / (REJECTED * spread);
            let kept = (1.0 - part * part).max(0.0);
            point.weight = moved.weight * kept * kept;
        }
        coefficients = solved(equations(&points), TERMS)?;
    }
    let agree = points.iter().filter(|point| point.residual(&coefficients).abs() < 3.0 * spread).count();
    let enough = agree >= LEAST_POINTS && agree as f64 >= LEAST_SHARE * points.len() as f64;
    if enough && spread <= LARGEST_SPREAD { chosen(&points) } else { None }
}

/// The fit with the fewest terms that explains the points about as well as all terms do (Schwarz 1978).
fn chosen(points: &[Point]) -> Option<[f64; TERMS]> {
    let squares = |coefficients: &[f64; TERMS]| -> f64 {
        let square = |residual: f64| residual * residual;
        points.iter().map(|point| point.weight * square(point.residual(coefficients))).sum()
    };
    let count = points.iter().filter(|point| point.weight > 0.0).count();
    let equations = equations(points);
    let fits: Vec<[f64; TERMS]> = CHOICES.into_iter().filter_map(|terms| solved(equations, terms)).collect();
    let variance = squares(fits.last()?) / count.checked_sub(TERMS)? as f64;
    // The logarithm of whole powers of two: that of floats may differ between machines.
    let price = |terms: usize| terms as f64 * LN_2 * f64::from(count.checked_ilog2().unwrap_or(0)) * variance;
    let cost = |&(terms, fit): &(usize, [f64; TERMS])| squares(&fit) + price(terms);
    CHOICES.into_iter().zip(fits).min_by(|a, b| cost(a).total_cmp(&cost(b))).map(|(_, fit)| fit)
}

fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

fn equations(points: &[Point]) -> Equations {
    let mut equations = [[0.0; TERMS + 1]; TERMS];
    for Point { terms: [a, b, c, d, e, f], rows, weight } in points {
        let values = [*a, *b, *c, *d, *e, *f, *rows];
        for (row, term) in equations.iter_mut().zip(values) {
            let weighted = weight * term;
            row.iter_mut().zip(values).for_each(|(sum, value)| *sum += weighted * value);
        }
    }
    equations
}

/// The fit of the first `count` terms by elimination; `None` if the points do not determine them. The other terms are 0.
fn solved(mut equations: Equations, count: usize) -> Option<[f64; TERMS]> {
    let rows = &mut equations[..count];
    for i in 0..count {
        let pivot = rows[i];
        if pivot[i].is_nan() || pivot[i] <= f64::EPSILON * rows[0][0].abs() {
            return None;
        }
        for (_, row) in rows.iter_mut().enumerate().filter(|&(other, _)| other != i) {
            let factor = row[i] / pivot[i];
            row.iter_mut().zip(pivot).for_each(|(value, pivot)| *value -= factor * pivot);
        }
    }
    Some(array::from_fn(|i| rows.get(i).map_or(0.0, |row| row[TERMS] / row[i])))
}
