//! Links inside a rendered book: each page, file and anchor that one names must be there.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io;
use std::path::{Component, Path, PathBuf};

use html5gum::{Token, Tokenizer};

/// What was found.
#[derive(Debug, Default)]
pub(super) struct Report {
    pub(super) pages: usize,
    pub(super) links: usize,
    /// Page and link of each that leads nowhere.
    pub(super) dead: Vec<String>,
}

/// What a page has and names.
#[derive(Debug, Default, PartialEq)]
struct Page {
    anchors: BTreeSet<String>,
    links: Vec<String>,
}

impl Page {
    fn read(html: &str) -> Page {
        let mut page = Page::default();
        for token in Tokenizer::new(html).flatten() {
            let Token::StartTag(tag) = token else {
                continue;
            };
            for (name, value) in &tag.attributes {
                let value = String::from_utf8_lossy(value).into_owned();
                match (&*tag.name.to_vec(), &*name.to_vec()) {
                    (_, b"id") => {
                        page.anchors.insert(value);
                    }
                    (b"a" | b"link", b"href") | (b"img" | b"script", b"src") => {
                        page.links.push(value);
                    }
                    _ => {}
                }
            }
        }
        page
    }
}

/// Checks all pages under `root`. The print page repeats the others with anchors of its own and is
/// left out, as is what mdBook makes of a page that is not found, whose links are from anywhere.
///
/// # Errors
/// Those of the file system.
pub(super) fn check(root: &Path) -> io::Result<Report> {
    let mut pages = BTreeMap::new();
    let mut folders = vec![root.to_path_buf()];
    while let Some(folder) = folders.pop() {
        for entry in folder.read_dir()? {
            let path = entry?.path();
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            if path.is_dir() {
                folders.push(path);
            } else if name.ends_with(".html")
                && !matches!(&*name, "print.html" | "404.html" | "toc.html")
            {
                let page = Page::read(&fs::read_to_string(&path)?);
                pages.insert(path, page);
            }
        }
    }
    let mut report = Report {
        pages: pages.len(),
        ..Report::default()
    };
    for (path, page) in &pages {
        for link in &page.links {
            if is_outside(link) {
                continue;
            }
            report.links += 1;
            if let Some(why) = fault(root, path, link, &pages) {
                let shown = path.strip_prefix(root).unwrap_or(path).display();
                report.dead.push(format!("{shown}: {link}: {why}"));
            }
        }
    }
    Ok(report)
}

/// Whether a link leaves the book. Those are not followed: a test must not depend on the weather.
fn is_outside(link: &str) -> bool {
    let scheme = link.split(['/', '?', '#']).next().unwrap_or_default();
    scheme.contains(':') || link.starts_with("//")
}

fn fault(
    root: &Path,
    from: &Path,
    link: &str,
    pages: &BTreeMap<PathBuf, Page>,
) -> Option<&'static str> {
    let (file, anchor) = match link.split_once('#') {
        Some((file, anchor)) => (file, Some(anchor)),
        None => (link, None),
    };
    let file = file.split('?').next().unwrap_or_default();
    let target = match file {
        "" => from.to_path_buf(),
        _ => plain(&from.parent().unwrap_or(root).join(file)),
    };
    if !target.starts_with(root) {
        return Some("leaves the book");
    }
    if !target.exists() {
        return Some("no such file");
    }
    match (anchor, pages.get(&target)) {
        (None | Some(""), _) => None,
        (Some(anchor), Some(page)) if page.anchors.contains(anchor) => None,
        (Some(_), _) => Some("no such anchor"),
    }
}

/// The path without `.` and `..`.
fn plain(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir => {
                plain.pop();
            }
            Component::CurDir => {}
            part => plain.push(part),
        }
    }
    plain
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_tells_its_anchors_and_links() {
        let page = Page::read(
            r##"<h1 id="top">x</h1><a href='b.html#c'>b</a><img src=d.svg><a name="n">no</a>"##,
        );
        assert_eq!(page.links, ["b.html#c", "d.svg"]);
        assert!(page.anchors.contains("top"));
    }

    #[test]
    fn links_are_followed_to_files_and_anchors() {
        let root = std::env::temp_dir().join(format!("servobus-links-{}", std::process::id()));
        let inner = root.join("inner");
        fs::create_dir_all(&inner).unwrap();
        let page = r##"<a href="#here"><a href="#gone"><a href="inner/a.html#x">
            <a href="none.html"><a href="https://example.org/none"><a href="../up.html">"##;
        fs::write(root.join("index.html"), format!("<p id=here>{page}")).unwrap();
        fs::write(
            inner.join("a.html"),
            "<p id=x><a href=\"../index.html#here\">",
        )
        .unwrap();
        let report = check(&root).unwrap();
        fs::remove_dir_all(&root).unwrap();
        assert_eq!((report.pages, report.links), (2, 6));
        assert_eq!(
            report.dead,
            [
                "index.html: #gone: no such anchor",
                "index.html: none.html: no such file",
                "index.html: ../up.html: leaves the book",
            ]
        );
    }
}
