//! Cramér–Rao bounds over curved seams: what the plates beside a seam would add, and what a production shows.
//!
//! `cargo run --release -p trueline-studies -- seam_bounds [strips|fleet]`
//!
//! Profiler with 0.04 mm, robot with 0.02 mm, 33 frames a second, knots of 10 mm, no prior on the form of the seam.

mod fleet;
mod information;
mod seam;
mod strips;

pub(crate) fn run(arguments: &[String]) -> Result<(), String> {
    match arguments.first().map(String::as_str) {
        None => {
            strips::print();
            println!();
            fleet::print();
        }
        Some("strips") => strips::print(),
        Some("fleet") => fleet::print(),
        Some(other) => return Err(format!("`{other}` is neither strips nor fleet")),
    }
    Ok(())
}
