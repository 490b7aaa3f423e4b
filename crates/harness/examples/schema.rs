//! Prints the JSON schema of recorded runs: `cargo run -p harness --example schema > results/schema.json`.

fn main() -> Result<(), serde_json::Error> {
    println!("{}", serde_json::to_string_pretty(&schemars::schema_for!(harness::record::Record))?);
    Ok(())
}
