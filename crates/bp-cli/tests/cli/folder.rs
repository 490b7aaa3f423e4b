//! A folder to run the program in.

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

use serde_json::Value;
use tempfile::TempDir;

pub(crate) const WIDTH: u32 = 40;
pub(crate) const HEIGHT: u32 = 24;
pub(crate) const SHIFT: u32 = 5;

/// A folder with a pair whose right view is shifted by 5 px, and its ground truth, twice the disparity.
pub(crate) struct Folder(TempDir);

impl Folder {
    pub(crate) fn new() -> Self {
        let folder = Self(tempfile::tempdir().unwrap());
        let noise = |x: u32, y: u32| ((x * x * 7 + x * y * 13 + y * 31 + x * 5) % 251) as u8;
        let view = |shift: u32| image::GrayImage::from_fn(WIDTH, HEIGHT, |x, y| image::Luma([noise(x + shift, y)]));
        view(0).save(folder.path("left.png")).unwrap();
        view(SHIFT).save(folder.path("right.png")).unwrap();
        view(SHIFT).save(folder.path("right.pgm")).unwrap();
        image::GrayImage::from_pixel(WIDTH, HEIGHT, image::Luma([10])).save(folder.path("truth.png")).unwrap();
        image::GrayImage::from_pixel(WIDTH + 1, HEIGHT, image::Luma([10])).save(folder.path("wide.png")).unwrap();
        folder
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub(crate) fn command(&self, arguments: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_bp"));
        command.args(arguments.split_whitespace()).current_dir(self.0.path()).env_remove("BP_DATA");
        command
    }

    pub(crate) fn run(&self, arguments: &str) -> Output {
        self.command(arguments).output().unwrap()
    }

    pub(crate) fn json(&self, arguments: &str) -> Value {
        let output = self.run(arguments);
        assert!(output.status.success(), "{arguments}: {}", text(&output.stderr));
        serde_json::from_slice(&output.stdout).unwrap()
    }

    /// Asserts that a command fails with this exit code and all `words` in its message, without a panic or a new file.
    pub(crate) fn fails(&self, arguments: &str, code: i32, words: &[&str]) {
        self.command_fails(&mut self.command(arguments), code, words);
    }

    pub(crate) fn command_fails(&self, command: &mut Command, code: i32, words: &[&str]) {
        let before = listing(self.0.path());
        let output = command.output().unwrap();
        let arguments = format!("{command:?}");
        let message = text(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{arguments}: {message}");
        assert!(words.iter().all(|word| message.contains(word)), "{arguments}: {message}");
        assert!(!message.contains("panicked"), "{message}");
        assert_eq!(listing(self.0.path()), before, "{arguments} left a file");
    }
}

pub(crate) fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn listing(folder: &Path) -> Vec<PathBuf> {
    let mut paths: Vec<_> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    paths
}

/// Arguments to match that pair; the path of the output must follow.
pub(crate) const MATCH: &str = "match left.png right.png --labels 12 --output";
