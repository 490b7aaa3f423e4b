//! A pair of 3x2 pixels with 3 labels, small enough to follow with pencil and paper. The code at the end checks the
//! data costs, labels, energies and most of the messages.
//!
//! ```text
//! left   40 52 60      right   52 60 61
//!        40 45 60              40 60 60
//! ```
//!
//! **Data costs**, profile `thesis`: `D = (7 min(|left(x) - right(x - d)|, 15) + 5) div 10`, and 11 where x - d < 0. At
//! (1, 0) label 0 compares 52 with 60, so it costs `(56 + 5) div 10 = 6`; label 1 compares 52 with 52; label 2 leaves
//! the image. Each cell lists the costs of labels 0, 1, 2:
//!
//! ```text
//!  8 11 11    6  0 11    1  0  6
//!  0 11 11   11  4 11    0  0 11
//! ```
//!
//! **Messages.** The slope is 10 and the truncation K is 17. In the first loop all received messages are 0, so (0, 0)
//! has `h = 8 11 11`. Neither the pass up the labels nor the pass down changes it. Subtracting the minimum 8 gives the
//! message `0 3 3`. (1, 0) has `h = 6 0 11`. The passes turn it into `6 0 10`, which goes to the left, right and down.
//! After one loop the nodes have received these messages from the left neighbour and from the one below:
//!
//! ```text
//! from the left    -         0  3  3    6  0 10
//!                  -         0 10 11    7  0  7
//! from below       0 10 11   7  0  7    0  0 10
//!                  -         -          -
//! ```
//!
//! **Labels** minimise the belief, which is D plus the four messages. After one loop they are `0 1 1 / 0 1 1`, with
//! energy 12 + 20 (data + smoothness); after two loops they are `1 0 1 / 1 1 1`, with 32 + 30. On a graph with cycles,
//! belief propagation does not guarantee descent. The least energy of all 729 labellings is 26, with all labels 0.
//!
//! **Coarse to fine**, two grids with one loop on each: grid 1 has two nodes. The costs of the first are the sums
//! `8+6+0+11 11+0+11+4 11+11+11+11 = 25 26 44`; the second covers only one column and has `1 0 17`. They send `0 1 11`
//! to the right and `1 0 10` to the left. On grid 0 every child with a neighbour on that side starts with these. After
//! the loop on grid 0, (0, 0) has received `7 0 10` from the right instead of `6 0 10`. The labels are `0 1 1 / 0 1 1`.
//!
//! **Cut into four** at (1, 1), with the census match of that pixel as a prior: there the strip is 3 pixels wide and 2
//! high, so only label 0 keeps it inside the right image. The four nodes around (1, 1) cost 0 for labels 0 and 1, and
//! 11 for label 2. The parts are columns 0 and 1..3 times rows 0 and 1. After two loops the labels are `0 1 1 / 0 0 0`,
//! with energy 19 + 30, computed with the images' own costs and over all edges.
//!
//! ```
//! use bp_core::{Cut, Energy, Image, Driver, MessageStart, Model, Plan, Profile, Schedule, Settings, Side, StereoPair};
//! use bp_core::{Backend, DataCost};
//!
//! # fn main() -> Result<(), bp_core::Error> {
//! let left = Image::from_grey(3, 2, [40, 52, 60, 40, 45, 60])?;
//! let right = Image::from_grey(3, 2, [52, 60, 61, 40, 60, 60])?;
//! let pair = StereoPair::new(left, right)?;
//! let model = Model::new(Profile::Thesis, 3)?;
//!
//! let cost = DataCost::of_pair(&pair, model)?;
//! let costs: Vec<_> = (0..6).map(|i| [0, 1, 2].map(|label| cost.at(i % 3, i / 3, label))).collect();
//! assert_eq!(costs, [[8, 11, 11], [6, 0, 11], [1, 0, 6], [0, 11, 11], [11, 4, 11], [0, 0, 11]]);
//!
//! let device = bp_cpu_scalar::Scalar.open(0)?;
//! let run = |grids, steps, cut| {
//!     let (schedule, message_start) = (Schedule::Sync, MessageStart::Receiver);
//!     let settings = Settings { grids, steps, schedule, message_start, cut, coarse_clip: false, label_sets: false };
//!     let mut driver = Driver::new(device.as_ref(), Plan::new(pair.size(), model, settings)?)?;
//!     driver.solve(&pair)?;
//!     let energy = Energy::of(&pair, &model, driver.labels())?;
//!     Ok::<_, bp_core::Error>((driver.labels().to_vec(), energy.data, energy.smoothness, driver))
//! };
//!
//! let (labels, data, smoothness, mut driver) = run(1, 1, None)?;
//! assert_eq!((labels, data, smoothness), (vec![0, 1, 1, 0, 1, 1], 12, 20));
//! let from_left = [0, 0, 0, 0, 3, 3, 6, 0, 10, 0, 0, 0, 0, 10, 11, 7, 0, 7];
//! assert_eq!(driver.messages(Side::Left)?, from_left);
//! assert_eq!(driver.messages(Side::Down)?, [0, 10, 11, 7, 0, 7, 0, 0, 10, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
//!
//! let (labels, data, smoothness, mut driver) = run(1, 2, None)?;
//! assert_eq!((labels, data, smoothness), (vec![1, 0, 1, 1, 1, 1], 32, 30));
//! let from_right = [10, 0, 10, 1, 0, 10, 0, 0, 0, 10, 0, 10, 1, 0, 10, 0, 0, 0];
//! assert_eq!(driver.messages(Side::Right)?, from_right);
//!
//! let (labels, data, smoothness, mut driver) = run(2, 1, None)?;
//! assert_eq!((labels, data, smoothness), (vec![0, 1, 1, 0, 1, 1], 12, 20));
//! assert_eq!(driver.messages(Side::Right)?[..3], [7, 0, 10]);
//! assert_eq!(driver.messages(Side::Down)?[..9], [0, 10, 17, 8, 0, 10, 0, 1, 11]);
//!
//! let cut = Cut { x: 1, y: 1, seed_start: true };
//! let (labels, data, smoothness, mut driver) = run(1, 2, Some(cut))?;
//! assert_eq!((labels, data, smoothness), (vec![0, 1, 1, 0, 0, 0], 19, 30));
//! assert_eq!(driver.messages(Side::Right)?[3..6], [1, 0, 6]);
//! assert_eq!(driver.messages(Side::Up)?, [0; 18]);
//! # Ok(())
//! # }
//! ```
