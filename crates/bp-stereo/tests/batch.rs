//! A batch through the public interface, so tiny that Miri can run it (scripts/miri).

use std::fs;

use bp_stereo::{
    Align, Making, Options, Watch,
    batch::{Also, BatchOptions, Shard, run},
    pairs::Source,
};

const WIDTH: usize = 8;
const HEIGHT: usize = 6;

fn view(shift: usize, seed: usize) -> Vec<u8> {
    let grey = |i: usize| ((i % WIDTH + shift) * 7919 + (i / WIDTH) * 104_729 + seed * 31) % 251;
    let pixels = (0..WIDTH * HEIGHT).map(|i| grey(i) as u8);
    format!("P5\n{WIDTH} {HEIGHT}\n255\n").into_bytes().into_iter().chain(pixels).collect()
}

#[test]
fn a_tiny_batch_is_matched_once() {
    let folder = tempfile::tempdir().unwrap();
    for (side, shift) in [("left", 0), ("right", 1)] {
        fs::create_dir(folder.path().join(side)).unwrap();
        for seed in 0..2 {
            fs::write(folder.path().join(side).join(format!("{seed}.pgm")), view(shift, seed)).unwrap();
        }
    }
    let output = folder.path().join("out");
    let options = BatchOptions {
        source: Source::Path(folder.path().to_owned()),
        output: output.clone(),
        alignment: None,
        matching: Options { align: Align::Off, threads: Some(2), ..Options::default().with_labels(4) },
        format: "npy".into(),
        also: vec![Also::Picture],
        shard: Shard::default(),
        warm_start: None,
        force: false,
        max_megapixels: 1,
    };
    let done = |options| {
        let summary = run(options, &Making::default(), &Watch::default()).unwrap();
        assert!(summary.failures.is_empty());
        (summary.done, summary.skipped)
    };
    assert_eq!((done(&options), done(&options)), ((2, 0), (2, 2)));
}
