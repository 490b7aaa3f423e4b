//! Compares labellings by other programs with ours under one energy: profile `mrf`, 16 labels.

use std::path::Path;

use bp_core::{Algorithm, Driver, Energy, Model, Observer, Plan, Profile, Schedule, Size, StereoPair, cheapest_labels};
use bp_io::{Limits, StoredGrey, parse_stored_grey};

use crate::{backends, failure::Failure, record::Labelling, scenes::Manifest};

/// The scenes, their labels, and the methods whose labellings the data folder holds.
const SCENES: [&str; 3] = ["tsukuba", "venus", "teddy"];
const LABELS: usize = 16;
const METHODS: [&str; 6] = ["ICM", "BP-S", "BP-M", "Swap", "Expansion", "TRW-S"];

/// Checkerboard iterations of our own method, plain BP.
const LOOPS: u32 = 75;

/// All labellings of all three scenes; none if the data folder lacks them.
pub(super) fn compare(folder: &Path, observer: &mut Observer<'_>) -> Result<Vec<Labelling>, Failure> {
    let mut labellings = Vec::new();
    if !folder.join("mrf-benchmark").is_dir() {
        return Ok(labellings);
    }
    for scene in SCENES {
        let pair = load_pair(folder, scene)?;
        let model = Model::new(Profile::Mrf, LABELS)?;
        let mut add = |method: &str, ours: bool, labels: &[u16]| -> Result<(), Failure> {
            let energy = Energy::of(&pair, &model, labels)?.into();
            labellings.push(Labelling { scene: scene.to_owned(), method: method.to_owned(), ours, energy });
            Ok(())
        };
        add("all-zero", false, &vec![0; pair.size().pixels()])?;
        add("WTA", false, &cheapest_labels(&pair, &model)?)?;
        for method in METHODS {
            add(method, false, &load_labels(folder, scene, method, pair.size())?)?;
        }
        let settings = Algorithm::Bp.settings(pair.size(), LOOPS, 1, Schedule::Checkerboard);
        let reference = backends::reference()?;
        let mut driver = Driver::new(reference.device.as_ref(), Plan::new(pair.size(), model, settings)?)?;
        driver.solve_observed(&pair, observer)?;
        add(&format!("BP, {LOOPS} checkerboard loops"), true, driver.labels())?;
    }
    Ok(labellings)
}

fn load_pair(folder: &Path, scene: &str) -> Result<StereoPair, Failure> {
    let manifest = Manifest::read()?;
    let image = |name: &str| {
        let path = folder.join(format!("middlebury2001-2003/{scene}/{name}"));
        Ok::<_, Failure>(manifest.checked(folder, &path)?.0)
    };
    Ok(StereoPair::new(image("imL.png")?, image("imR.png")?)?)
}

/// Reads labels, which are stored as 17 times their value.
fn load_labels(folder: &Path, scene: &str, method: &str, size: Size) -> Result<Vec<u16>, Failure> {
    let path = folder.join(format!("mrf-benchmark/{scene}/{scene}-{method}.png"));
    let (_, contents) = Manifest::read()?.checked(folder, &path)?;
    let StoredGrey { size: found, values, .. } = parse_stored_grey(&path, &contents.bytes, Limits::default())?;
    if found != size || values.iter().any(|value| value % 17 != 0) {
        return Err(Failure::reading(&path, &"not a label map of this scene"));
    }
    Ok(values.into_iter().map(|value| value / 17).collect())
}
