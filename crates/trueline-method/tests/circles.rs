//! Tests that source files have no circular dependencies.
//!
//! `use` paths, and paths in the text that begin with `crate::`, `super::` or `self::`, are followed to their file; a name
//! re-exported by a `mod.rs` or `lib.rs` is followed to its original file. Declaring a module (`mod x;`) is no use of it.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// The files of a crate by module path: `a::b` → text.
type Modules = BTreeMap<String, String>;

/// Crates with known circles.
const STILL_CIRCULAR: [&str; 0] = [];

fn modules(src: &Path) -> Modules {
    let mut found = Modules::new();
    let mut folders = vec![(src.to_owned(), String::new())];
    while let Some((folder, prefix)) = folders.pop() {
        for entry in fs::read_dir(&folder).unwrap() {
            let path: PathBuf = entry.unwrap().path();
            let stem = path.file_stem().unwrap().to_str().unwrap().to_owned();
            let name = if prefix.is_empty() { stem.clone() } else { format!("{prefix}::{stem}") };
            if path.is_dir() {
                folders.push((path, name));
            } else if path.extension().is_some_and(|e| e == "rs") {
                let is_root = stem == "mod" || (prefix.is_empty() && (stem == "lib" || stem == "main"));
                let text = code(&fs::read_to_string(&path).unwrap());
                found.insert(if is_root { prefix.clone() } else { name }, text);
            }
        }
    }
    found
}

/// The code without comments and without the unit tests at the end of a file, which may use anything.
fn code(text: &str) -> String {
    let is_of_tests = |after: &str| {
        after
            .trim_start()
            .lines()
            .find(|line| !line.starts_with("#["))
            .is_some_and(|line| line.starts_with("mod "))
    };
    let end = text.match_indices("#[cfg(test)]").find(|(at, mark)| is_of_tests(&text[at + mark.len()..]));
    let text = end.map_or(text, |(at, _)| &text[..at]);
    let lines = text.lines().map(|line| line.split("//").next().unwrap_or(line));
    lines.collect::<Vec<_>>().join("\n")
}

/// `a::{b, c::{d, e as f}}` → `a::b`, `a::c::d`, `a::c::e`.
fn expanded(path: &str) -> Vec<String> {
    let path = path.trim();
    let Some(open) = path.find('{') else {
        let name = path.split(" as ").next().unwrap_or(path).trim().trim_end_matches("::self");
        return if name.is_empty() { Vec::new() } else { vec![name.to_owned()] };
    };
    let Some(close) = path.rfind('}').filter(|close| *close > open) else { return Vec::new() };
    let (prefix, inside) = (&path[..open], &path[open + 1..close]);
    let (mut depth, mut start, mut parts) = (0, 0, Vec::new());
    for (at, c) in inside.char_indices() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                parts.push(&inside[start..at]);
                start = at + 1;
            }
            _ => {}
        }
    }
    parts.push(&inside[start..]);
    let joined = parts.iter().flat_map(|part| expanded(part)).map(|part| format!("{prefix}{part}"));
    joined.map(|name| name.trim_end_matches("::self").to_owned()).collect()
}

/// All paths in a file: those of its `use` items, and those written out.
fn paths(text: &str) -> Vec<String> {
    let mut found = Vec::new();
    for item in text.split(';') {
        let Some(at) = item.rfind("use ").filter(|at| {
            let before = item[..*at].trim_end_matches(' ');
            before.is_empty() || before.ends_with(['\n', '}', ')', ']']) || before.ends_with("pub")
        }) else {
            continue;
        };
        found.extend(expanded(&item[at + 4..]));
    }
    for start in ["crate::", "super::", "self::"] {
        for (at, _) in text.match_indices(start) {
            let is_path = |c: char| c.is_alphanumeric() || c == '_' || c == ':';
            if at > 0 && text[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_' || c == ':') {
                continue;
            }
            let end = text[at..].find(|c: char| !is_path(c)).map_or(text.len(), |length| at + length);
            // The beginning of a group of `use`, expanded above.
            if text[end..].starts_with('{') {
                continue;
            }
            found.push(text[at..end].trim_end_matches(':').to_owned());
        }
    }
    found
}

/// A path from within `module`, relative to the crate's root. `None` if it leads to another crate.
fn absolute(module: &str, path: &str, modules: &Modules) -> Option<String> {
    let mut at: Vec<&str> = module.split("::").filter(|s| !s.is_empty()).collect();
    let mut rest = path.split("::").peekable();
    match *rest.peek()? {
        "crate" => {
            at.clear();
            rest.next();
        }
        "self" => drop(rest.next()),
        "super" => {
            while rest.peek() == Some(&"super") {
                at.pop();
                rest.next();
            }
        }
        // Without one of these a path names a child, or another crate.
        child => {
            let name = if module.is_empty() { child.to_owned() } else { format!("{module}::{child}") };
            modules.get(&name)?;
        }
    }
    at.extend(rest);
    Some(at.join("::"))
}

/// The file of a path: its longest part that is a file, followed through re-exports.
fn file_of(path: &str, modules: &Modules, depth: usize) -> Option<String> {
    let parts: Vec<&str> = path.split("::").filter(|s| !s.is_empty()).collect();
    let length = (0..=parts.len()).rev().find(|n| modules.contains_key(&parts[..*n].join("::")))?;
    let file = parts[..length].join("::");
    let Some(name) = parts.get(length).filter(|_| depth < 8) else { return Some(file) };
    let text = &modules[&file];
    for item in text.split(';') {
        let Some(at) = item.find("pub use ").or_else(|| item.find("pub(crate) use ")) else { continue };
        let names = expanded(item[at..].split_once("use ").map_or("", |(_, names)| names));
        for target in names.iter().filter(|target| target.rsplit("::").next() == Some(*name)) {
            let next = absolute(&file, target, modules).and_then(|next| file_of(&next, modules, depth + 1));
            if next.as_ref().is_some_and(|next| *next != file) {
                return next;
            }
        }
    }
    Some(file)
}

fn uses(module: &str, modules: &Modules) -> BTreeSet<String> {
    let found = paths(&modules[module]);
    let targets = found.iter().filter_map(|path| file_of(&absolute(module, path, modules)?, modules, 0));
    targets.filter(|target| target != module).collect()
}

/// One circle, if there is any. It is found by following dependencies until a file repeats.
fn circle(edges: &BTreeMap<String, BTreeSet<String>>) -> Option<Vec<String>> {
    let mut done = BTreeSet::new();
    for start in edges.keys() {
        let mut way: Vec<(String, Vec<String>)> =
            vec![(start.clone(), edges[start].iter().cloned().collect())];
        while let Some((at, left)) = way.last_mut() {
            let Some(next) = left.pop() else {
                done.insert(at.clone());
                way.pop();
                continue;
            };
            if let Some(first) = way.iter().position(|(file, _)| *file == next) {
                return Some(way[first..].iter().map(|(file, _)| file.clone()).collect());
            }
            if !done.contains(&next) {
                let uses = edges[&next].iter().cloned().collect();
                way.push((next, uses));
            }
        }
    }
    None
}

fn circle_in(modules: &Modules) -> Option<Vec<String>> {
    // A root's re-exports are for others; the check looks through roots without walking them.
    let is_root = |name: &str| {
        name.is_empty()
            || modules.keys().any(|other| other.strip_prefix(name).is_some_and(|r| r.starts_with("::")))
    };
    let walked = |name: &str| !is_root(name) || modules[name].contains("fn ");
    let edges = modules
        .keys()
        .map(|name| {
            let uses = if walked(name) { uses(name, modules) } else { BTreeSet::new() };
            (name.clone(), uses.into_iter().filter(|to| !to.is_empty()).collect())
        })
        .collect();
    circle(&edges)
}

#[test]
fn no_circle_of_files_in_any_crate() {
    let crates = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
    let mut circles = Vec::new();
    for entry in fs::read_dir(crates).unwrap() {
        let folder = entry.unwrap().path();
        if STILL_CIRCULAR.iter().any(|name| folder.ends_with(name)) {
            continue;
        }
        if let Some(circle) = circle_in(&modules(&folder.join("src"))) {
            circles.push(format!("{}: {}", folder.display(), circle.join(" → ")));
        }
    }
    assert!(circles.is_empty(), "files use each other in a circle:\n{}", circles.join("\n"));
}

/// The folders and single files at the top of a crate, and the dependencies between them.
fn folder_edges(modules: &Modules) -> BTreeMap<String, BTreeSet<String>> {
    let top = |name: &str| name.split("::").next().unwrap_or_default().to_owned();
    let mut edges: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for name in modules.keys().filter(|name| !name.is_empty()) {
        let own = top(name);
        let used = uses(name, modules);
        let others = used.iter().map(|to| top(to)).filter(|to| !to.is_empty() && *to != own);
        edges.entry(own.clone()).or_default().extend(others);
    }
    edges
}

#[test]
fn no_circle_of_folders_in_the_method() {
    let modules = modules(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/src")));
    let circle = circle(&folder_edges(&modules));
    assert!(
        circle.is_none(),
        "folders use each other in a circle: {}",
        circle.unwrap_or_default().join(" → ")
    );
}

#[test]
fn circles_of_every_form_are_found() {
    let of = |files: &[(&str, &str)]| -> Modules {
        files.iter().map(|(name, text)| ((*name).to_owned(), code(text))).collect()
    };
    let is_circular = |files: &[(&str, &str)]| circle_in(&of(files)).is_some();
    assert!(is_circular(&[
        ("", "mod a;\nmod b;"),
        ("a", "use crate::b::B;"),
        ("b", "use crate::{a::A, c};")
    ]));
    assert!(
        is_circular(&[("", ""), ("a", "use super::b;"), ("b", "fn f() -> crate::a::A {}")]),
        "in the text"
    );
    assert!(is_circular(&[
        ("", "pub use a::A;"),
        ("a", "use crate::b::{self, B};"),
        ("b", "use std::fmt;\nuse crate::A;")
    ]));
    assert!(is_circular(&[
        ("m", "mod x;\nmod y;\npub use x::X;"),
        ("m::x", "use super::y::Y;"),
        ("m::y", "use crate::m::X;")
    ]));
    // A root with functions of its own is like another file. Its re-exports resolve to their sources.
    assert!(!is_circular(&[
        ("", ""),
        ("m", "pub(crate) use x::{X, Y};\nuse crate::a::f;\nfn g() {}"),
        ("m::x", "pub struct X;"),
        ("a", "use crate::m::{X, Y};")
    ]));
    assert!(!is_circular(&[
        ("", "mod m;\npub use m::X;"),
        ("m", "mod x;\npub use x::X;"),
        ("m::x", "use crate::b::B;"),
        (
            "b",
            "// use crate::m::X;\nuse std::b::x;\n#[cfg(test)]\n#[allow(x)]\nmod tests { use crate::m::X; }"
        )
    ]));
    // Folders may form a circle without a circle of files.
    let folders =
        [("a::x", "use crate::b::y::Y;"), ("a::z", ""), ("b::y", ""), ("b::w", "use crate::a::z::Z;")];
    assert!(!is_circular(&folders));
    assert!(circle(&folder_edges(&of(&folders))).is_some());
    assert!(is_circular(&[("a", "use crate::b::B;"), ("b", "#[cfg(test)]\nuse crate::a::A;\nmod c;")]));
}
