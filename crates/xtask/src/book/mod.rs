//! The book: the pages of `docs/`, rendered and checked.

mod links;

use std::fs;
use std::path::PathBuf;

use crate::command::{ask, succeed};
use crate::step::{StepResult, Trouble};
use crate::workspace::Workspace;

/// The renderer, a program of its own (MPL-2.0) that is no part of anything built here.
const MDBOOK: &str = "mdbook";
const VERSION: &str = "0.5.4";

/// Renders the book to `target/book` and follows every link inside it.
///
/// # Errors
/// What mdBook says, pages that are in no chapter, and links that lead nowhere.
pub(crate) fn run(workspace: &Workspace) -> StepResult {
    let mdbook = mdbook(workspace)?;
    check_chapters(workspace)?;
    let output = workspace.target().join("book");
    let mut build = workspace.command(&mdbook);
    build.arg("build").arg("--dest-dir").arg(&output).arg(".");
    succeed(&mut build)?;
    let report = links::check(&output)
        .map_err(|error| Trouble::Failed(format!("{}: {error}", output.display())))?;
    if report.dead.is_empty() {
        let index = output.join("index.html");
        return Ok(format!(
            "{} pages, {} links inside; {}",
            report.pages,
            report.links,
            index.display()
        ));
    }
    for dead in &report.dead {
        println!("{dead}");
    }
    Err(Trouble::Failed(format!(
        "{} links lead nowhere",
        report.dead.len()
    )))
}

/// Every page is a chapter: what nobody finds nobody reads.
fn check_chapters(workspace: &Workspace) -> Result<(), Trouble> {
    let docs = workspace.root().join("docs");
    let wrong = |error| Trouble::Failed(format!("{}: {error}", docs.display()));
    let summary = fs::read_to_string(docs.join("SUMMARY.md")).map_err(wrong)?;
    let mut lost = Vec::new();
    let mut folders = vec![docs.clone()];
    while let Some(folder) = folders.pop() {
        for entry in folder.read_dir().map_err(wrong)? {
            let path = entry.map_err(wrong)?.path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let name = path.strip_prefix(&docs).unwrap_or(&path);
            let name = name.to_string_lossy().replace('\\', "/");
            let is_page = name.ends_with(".md") && name != "SUMMARY.md";
            if is_page && !summary.contains(&format!("({name})")) {
                lost.push(name);
            }
        }
    }
    lost.sort();
    match lost.as_slice() {
        [] => Ok(()),
        lost => Err(Trouble::Failed(format!(
            "not in docs/SUMMARY.md: {}",
            lost.join(", ")
        ))),
    }
}

/// The renderer, installed under `target/` if it is not there in this version.
fn mdbook(workspace: &Workspace) -> Result<PathBuf, Trouble> {
    let root = workspace.target().join("tools");
    let program = root
        .join("bin")
        .join(format!("{MDBOOK}{}", std::env::consts::EXE_SUFFIX));
    let version = ask(workspace.command(&program).arg("--version"));
    if version.is_some_and(|is| is.trim() == format!("mdbook v{VERSION}")) {
        return Ok(program);
    }
    println!("installing {MDBOOK} {VERSION} in {}", root.display());
    let mut install = workspace.cargo();
    install.args(["install", MDBOOK, "--version", VERSION, "--locked"]);
    install.args(["--no-default-features", "--features", "search"]);
    install.arg("--root").arg(&root);
    succeed(&mut install).map_err(|_| {
        Trouble::impossible(
            format!("{MDBOOK} {VERSION} could not be installed"),
            "let cargo reach crates.io or a mirror of it",
        )
    })?;
    Ok(program)
}
