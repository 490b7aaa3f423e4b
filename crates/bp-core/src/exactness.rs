//! Why 8 bits are exact.
//!
//! Claim: let the data costs, the truncation K and the slope s be whole numbers, and K at most 63. Store data costs as
//! `min(D(p, d) - min_d D(p, d), 4K + 1)` and compute messages from them in `u8` with saturating adds. Then messages
//! and labels, ties included, equal those computed from D itself in unbounded integers.
//!
//! A message from p to a neighbour, over labels a of p and d of the neighbour, is
//!
//! ```text
//! h(a) = D(p, a) + sum of the messages that p received from its other neighbours (at most three)
//! M(d) = min over a of (h(a) + min(s |a - d|, K))  -  min over a of h(a)
//! ```
//!
//! **Messages lie in 0..=K.** The label with the least h contributes at most `h_min + K` to the minimum for every d,
//! and no label contributes less than `h_min`.
//!
//! **A node's constant cancels.** Adding c to D(p, d) for all d adds c to every h(a), and M subtracts it again. It also
//! adds c to every belief, which moves no minimum. So assume that the least data cost of a node is 0. Then
//! `h_min <= 0 + 3K`: the cheapest label has data cost 0 and receives at most three messages of at most K. Likewise,
//! the least belief is at most 4K.
//!
//! **Large entries do not matter.** An entry with `h(a) >= h_min + K` changes no message, because the truncation
//! already limits the minimum for every label to `h_min + K`. Since `h_min + K <= 4K`, replacing any h(a) above 4K by
//! another value of at least 4K changes nothing. Clipping D at `4K + 1` and saturating at 255 do exactly that, because
//! 4K <= 252: a clipped or saturated value was above 4K and stays above it. The passes of the lower envelope add s to
//! entries; a sum that saturates there is above 4K too.
//!
//! **Ties survive.** The least belief is at most 4K. An entry that was clipped (at least `4K + 1`) or saturated (255,
//! above 252) is greater, so it is never the least and never ties with it. All entries up to 4K are exact. Clipping at
//! 4K itself would be wrong, because it could create a tie.
//!
//! **Labels one after another.** Under [`crate::Schedule::Sweep`] a label minimises D plus at most four terms:
//! messages, or smoothness costs to labels already decided. Each lies in 0..=K, so the argument for beliefs applies.
//!
//! **Interpolated first messages.** Under [`crate::Schedule::Sweep`] they lie between coarse messages, so in 0..=K. Their
//! least value may exceed 0, but no bound here needs it to be 0.
//!
//! **Label sets** ([`crate::Settings::label_sets`]) leave out labels. All of the above holds for the labels of a node's set
//! alone: the least cost and `h_min` are those over the set, and a label d of the receiver's set gets at most
//! `h_min + K`, whether the sender's set has it or not. The passes over a set's sorted list add `s (l' - l)`, at most 255,
//! between the neighbours l and l'; a sum that saturates is above 4K. So a value that skips labels equals the one that the
//! passes over all labels would carry across them. A backend that keeps all labels may give those outside the set the data
//! cost 255, which no sum of a label in it reaches.
//!
//! **Messages for other labels.** A message M that its receiver holds for the labels S rises by at most s from one label to the
//! next, times their distance: it is an envelope of the slope of its edge's level, at most s, cut at a constant, or the rounded
//! mean of such. So the least `M(e) + s |d - e|` over e in S is offered by the nearest label of S below d or above it.
//!
//! **Coarser grids.** A coarse node's cost is the sum of its children's. Subtracting a child's least cost first shifts
//! the sum by a constant, which cancels; clipping a child first would not. So unclipped costs are summed, and the sums
//! are normalised and clipped. The lower clip of [`crate::Settings::coarse_clip`] changes what is computed, not how:
//! with it, D of a coarse grid means the clipped cost.
//!
//! **Edge levels** ([`crate::EdgeLevels`]). Above, s and K are those of the first level; no level has greater ones. A message
//! over an edge with the truncation K' lies in 0..=K', hence in 0..=K. Its truncation limits the minimum to `h_min + K'`, so an
//! entry above `h_min + K` matters even less. All bounds here hold with s and K.
//!
//! **Plain adds.** A sum never exceeds `4K + 1 + 3K + min(s, K)` in a message update and `4K + 1 + 4K` in a belief.
//! If these are at most 255, wrapping adds give the same result; otherwise adds must saturate.
//!
//! The property test `u8_equals_unbounded_integers` of bp-cpu-scalar checks all this against an `i64` oracle, which
//! normalises and clips only where the definition does.
