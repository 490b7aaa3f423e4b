//! Finds circles of imports among the modules of a crate.
//!
//! A module counts with everything inside it, so modules beside each other are compared, on every level. What a module takes
//! from those around it is no circle: they are its own folder.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
};

/// The names from the crate's root to a module, or to something in it.
type Names = Vec<String>;

/// The imports of a module, and the names that it hands on from others.
#[derive(Default)]
struct Module {
    imports: Vec<Names>,
    hands_on: BTreeMap<String, Names>,
}

/// The modules of a circle, from one back to itself, if there is any. Sources are those of a crate, by their path in `src`.
pub(crate) fn circle(sources: &BTreeMap<PathBuf, String>) -> Option<Vec<String>> {
    let paths: BTreeSet<Names> = sources.keys().map(|path| module_of(path)).collect();
    let read = |(path, text): (&PathBuf, &String)| (module_of(path), module(&module_of(path), text, &paths));
    let modules: BTreeMap<Names, Module> = sources.iter().map(read).collect();
    let mut edges: BTreeMap<Names, BTreeSet<Names>> = BTreeMap::new();
    for (from, module) in &modules {
        for to in module.imports.iter().map(|import| holder(import, &modules, 0)) {
            let shared = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
            if shared < from.len() && shared < to.len() {
                edges.entry(from[..=shared].to_vec()).or_default().insert(to[..=shared].to_vec());
            }
        }
    }
    let walk = edges.keys().find_map(|start| way_back(start, start, &edges, &mut BTreeSet::new()))?;
    Some(walk.iter().rev().map(|names| names.join("::")).collect())
}

fn module_of(path: &Path) -> Names {
    let names: Names = path.with_extension("").iter().map(|name| name.to_string_lossy().into_owned()).collect();
    if matches!(names.join("/").as_str(), "lib" | "main") { Vec::new() } else { names }
}

/// The way from a module to `start`, last step first.
fn way_back(
    from: &Names,
    start: &Names,
    edges: &BTreeMap<Names, BTreeSet<Names>>,
    seen: &mut BTreeSet<Names>,
) -> Option<Vec<Names>> {
    for to in edges.get(from)? {
        if to == start {
            return Some(vec![start.clone(), from.clone()]);
        }
        let further = if seen.insert(to.clone()) { way_back(to, start, edges, seen) } else { None };
        if let Some(mut way) = further {
            way.push(from.clone());
            return Some(way);
        }
    }
    None
}

/// The module that a name comes from, behind all modules that hand it on.
fn holder(import: &[String], modules: &BTreeMap<Names, Module>, depth: usize) -> Names {
    let len = (0..=import.len()).rev().find(|&len| modules.contains_key(&import[..len])).unwrap_or(0);
    let (module, rest) = import.split_at(len);
    let handed_on = rest.first().and_then(|name| modules.get(module)?.hands_on.get(name));
    match handed_on {
        Some(other) if depth < 8 => holder(&[other, &rest[1..]].concat(), modules, depth + 1),
        _ => module.to_vec(),
    }
}

fn module(own: &Names, text: &str, paths: &BTreeSet<Names>) -> Module {
    let code: Vec<&str> = text.lines().map(str::trim_start).filter(|line| !line.starts_with("//")).collect();
    let mut module = Module::default();
    for import in imports(&code) {
        for (name, names) in written_out(&import) {
            let Some(names) = absolute(own, &names, paths) else { continue };
            // Modules within this one see what it imports, whether that is public or not.
            module.hands_on.insert(name, names.clone());
            module.imports.push(names);
        }
    }
    module.imports.extend(within(&code.join("\n")).iter().filter_map(|names| absolute(own, names, paths)));
    module
}

/// The text of each import, from after the word `use` to its semicolon.
fn imports(code: &[&str]) -> Vec<String> {
    let start = |line: &str| {
        let after = line.strip_prefix("pub").map_or(line, |rest| rest.split_once(')').map_or(rest, |(_, rest)| rest));
        after.trim_start().strip_prefix("use ").map(str::to_owned)
    };
    let text = |(i, line): (usize, &&str)| Some([start(line)?, code[i + 1..].join(" ")].join(" "));
    let all = code.iter().enumerate().filter_map(text);
    all.map(|text| text.split(';').next().unwrap_or_default().to_owned()).collect()
}

/// The paths within code that begin at the crate's root or a module around.
fn within(code: &str) -> Vec<Names> {
    let is_of_name = |c: char| c.is_alphanumeric() || c == '_' || c == ':';
    let starts = ["crate::", "super::"].into_iter().flat_map(|word| code.match_indices(word).map(|(start, _)| start));
    let path = |start: usize| {
        let path = &code[start..];
        let end = path.find(|c| !is_of_name(c)).unwrap_or(path.len());
        path[..end].split("::").map(str::to_owned).collect()
    };
    starts.filter(|&start| !code[..start].ends_with(is_of_name)).map(path).collect()
}

/// `a::{b, c::d as e}` as b, which is `a::b`, and e, which is `a::c::d`.
fn written_out(import: &str) -> Vec<(String, Names)> {
    let Some((head, group)) = import.split_once('{') else {
        let (path, name) = import.split_once(" as ").map_or((import, None), |(path, name)| (path, Some(name)));
        let path = path.trim().trim_end_matches("::self");
        let names: Names = path.split("::").map(|name| name.trim().to_owned()).collect();
        let name = name.map_or_else(|| names.last().cloned().unwrap_or_default(), |name| name.trim().to_owned());
        return vec![(name, names)];
    };
    let group = group.rsplit_once('}').map_or(group, |(group, _)| group);
    let (mut depth, mut parts) = (0, vec![String::new()]);
    for c in group.chars() {
        depth += i32::from(c == '{') - i32::from(c == '}');
        match c {
            ',' if depth == 0 => parts.push(String::new()),
            c => parts.last_mut().unwrap().push(c),
        }
    }
    let parts = parts.iter().filter(|part| !part.trim().is_empty());
    parts.flat_map(|part| written_out(&format!("{}{}", head.trim(), part.trim()))).collect()
}

/// The names from the crate's root; `None` for another crate's.
fn absolute(own: &Names, names: &[String], paths: &BTreeSet<Names>) -> Option<Names> {
    let beside = |name: &String| own.iter().chain([name]).cloned().collect::<Names>();
    let (from, rest): (Names, &[String]) = match names.first()?.as_str() {
        "crate" => (Vec::new(), &names[1..]),
        "self" => (own.clone(), &names[1..]),
        "super" => {
            let up = names.iter().take_while(|name| *name == "super").count();
            (own[..own.len().saturating_sub(up)].to_vec(), &names[up..])
        }
        _ if paths.contains(&beside(&names[0])) => (own.clone(), names),
        _ => return None,
    };
    Some(from.into_iter().chain(rest.iter().cloned()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn circle_of(sources: &[(&str, &str)]) -> Option<String> {
        let sources = sources.iter().map(|(path, text)| (PathBuf::from(path), (*text).to_owned()));
        circle(&sources.collect()).map(|names| names.join(" -> "))
    }

    #[test]
    fn circles_are_found_through_groups_re_exports_and_paths_in_code() {
        let root = ("lib.rs", "mod a;\nmod b;\npub use b::B;\n");
        let first = ("a.rs", "use crate::{\n    B,\n    other,\n};\n");
        assert_eq!(circle_of(&[root, first, ("b.rs", "pub struct B;\n")]), None);
        for back in ["use crate::a::A;", "use super::{a::A as C};", "fn f() { crate::a::g() }"] {
            assert_eq!(circle_of(&[root, first, ("b.rs", back)]), Some("a -> b -> a".to_owned()), "{back}");
        }
        assert_eq!(circle_of(&[root, first, ("b.rs", "// see crate::a\n")]), None);
    }

    #[test]
    fn what_a_module_imports_goes_on_to_those_within_it() {
        let room = ("a.rs", "use c::{\n    C as D,\n};\n");
        let (first, second) = (("a/b.rs", "use super::{self as up, D};\n"), ("a/c.rs", "use super::super::a::b::f;\n"));
        assert_eq!(circle_of(&[("lib.rs", ""), room, first, ("a/c.rs", "")]), None);
        assert_eq!(circle_of(&[("lib.rs", ""), room, first, second]), Some("a::b -> a::c -> a::b".to_owned()));
    }

    #[test]
    fn a_folder_and_its_files_are_no_circle_but_files_in_it_may_be() {
        let (room, inner) = (("a.rs", "mod b;\nmod c;\nuse b::B;\n"), ("a/b.rs", "use super::A;\nuse super::c::C;\n"));
        assert_eq!(circle_of(&[("main.rs", ""), room, inner, ("a/c.rs", "")]), None);
        let back = ("a/c.rs", "use crate::a::b::B;\n");
        assert_eq!(circle_of(&[("main.rs", ""), room, inner, back]), Some("a::b -> a::c -> a::b".to_owned()));
    }
}
