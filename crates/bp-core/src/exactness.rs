//! Why 8 bits are exact.
//!
//! Claim: with data costs, truncation K and slope s in whole numbers and K at most 63, messages computed in `u8` from
//! data costs stored as `min(D(p, d) - min_d D(p, d), 4K + 1)`, with saturating adds, equal those that unbounded
//! integers give from D itself, and so do the labels, ties included.
//!
//! A message from p to a neighbour, over labels a of p and d of the neighbour, is
//!
//! ```text
//! h(a) = D(p, a) + sum of the messages that p received from its other neighbours (at most three)
//! M(d) = min over a of (h(a) + min(s |a - d|, K))  -  min over a of h(a)
//! ```
//!
//! **Messages lie in 0..=K.** The label of least h offers `h_min + K` to every d, and no label offers less than `h_min`.
//!
//! **A node's constant cancels.** Adding c to D(p, d) for all d adds c to every h(a), and M subtracts it again; it adds
//! c to every belief and moves no minimum. So the least data cost of a node may be taken as 0. Then
//! `h_min <= 0 + 3K` (the cheapest label has data cost 0 and at most three messages of at most K), and the least belief
//! is at most 4K in the same way.
//!
//! **Large entries do not matter.** An entry with `h(a) >= h_min + K` changes no message: in its place the truncation
//! already offers `h_min + K` to every label. Since `h_min + K <= 4K`, replacing any h(a) above 4K by another value of
//! at least 4K changes nothing. Clipping D at `4K + 1` and saturating at 255 both do just that, as 4K <= 252: whatever
//! is clipped or saturated was above 4K and stays above it. The lower envelope's passes add s to entries; a sum that
//! saturates is above 4K too.
//!
//! **Ties survive.** The least belief is at most 4K. An entry that was clipped (at least `4K + 1`) or saturated (255,
//! above 252) is greater, so it never is the least and never ties with it; all entries up to 4K are exact. Clipping at
//! 4K itself would be wrong: it could make a tie that is not there.
//!
//! **Labels one after another.** Under [`crate::Schedule::Sweep`] a label minimises D plus at most four terms, messages
//! or smoothness costs to labels decided before. Each lies in 0..=K, so all that is said of beliefs holds.
//!
//! **Coarser grids.** A coarse node's cost is the sum of its children's. Taking off a child's least cost first shifts
//! the sum by a constant, which cancels; clipping a child first would not. So sums are taken over unclipped costs, and
//! normalised and clipped after. The lower clip of [`crate::Settings::coarse_clip`] is part of what is computed, not of
//! how: with it, D of a coarse grid means the clipped cost.
//!
//! **Weak edges** ([`crate::Model::with_weak_edges`]) have a slope and a truncation of their own, both at most s and K. A
//! message over one lies in 0..=K div 2, so within 0..=K, and its truncation offers `h_min + K div 2`, so that an entry above
//! `h_min + K` matters even less to it. All bounds here hold with s and K.
//!
//! **Plain adds.** A sum never exceeds `4K + 1 + 3K + min(s, K)` in a message update and `4K + 1 + 4K` in a belief.
//! Where these are at most 255, wrapping adds give the same; otherwise they must saturate.
//!
//! The property test `u8_equals_unbounded_integers` of bp-cpu-scalar holds all this against
//! an oracle in `i64` that neither normalises nor clips what the definition leaves alone.
