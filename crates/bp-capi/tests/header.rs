//! The header belongs to the code.

use std::{env, fs, path::Path};

#[test]
fn the_header_is_current() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut made = Vec::new();
    let config = cbindgen::Config::from_file(folder.join("cbindgen.toml")).unwrap();
    let files = ["status", "image", "matcher"].map(|name| folder.join("src").join(name).with_extension("rs"));
    let builder = files.into_iter().fold(cbindgen::Builder::new().with_config(config), cbindgen::Builder::with_src);
    builder.generate().unwrap().write(&mut made);
    let path = folder.join("include/bpstereo.h");
    if env::var_os("BLESS").is_some() {
        fs::write(&path, &made).unwrap();
    }
    let made = String::from_utf8(made).unwrap();
    assert_eq!(fs::read_to_string(&path).unwrap(), made, "run BLESS=1 cargo test -p bp-capi --test header");
}
