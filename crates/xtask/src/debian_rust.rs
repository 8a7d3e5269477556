//! Debian's Rust compiler with its library source, unpacked under `target/` beside the machine's
//! own toolchain: it can build `core` for a target that no package carries. Nothing is installed;
//! any Debian or Ubuntu that offers the packages will do, root or not.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::command::{ask, succeed};
use crate::step::{StepResult, Trouble};
use crate::thumb::TARGET;
use crate::workspace::Workspace;
use crate::{apt, command};

const HOST: &str = "x86_64-unknown-linux-gnu";

/// Sets `cargo` up to build `core` with Debian's compiler, which is fetched if it is not here yet.
///
/// # Errors
/// [`Trouble::Impossible`] where Debian does not offer a compiler that is new enough.
pub(crate) fn drive(workspace: &Workspace, cargo: &mut Command) -> StepResult {
    let not_here = |why: String| {
        let remedy = format!("rustup target add {TARGET} on a machine where rustup can");
        Trouble::impossible(why, remedy)
    };
    if cfg!(not(all(target_os = "linux", target_arch = "x86_64"))) {
        return Err(not_here("Debian's compiler is only tried on x86-64".into()));
    }
    let mut version = versions();
    if version.is_none() && apt::may_install() {
        apt::update()?;
        version = versions();
    }
    let Some(version) = version else {
        return Err(not_here(
            "apt offers no rustc-web and rust-web-src of one version".into(),
        ));
    };
    let prefix = workspace.target().join("m4").join(&version);
    if !prefix.join("complete").is_file() {
        println!("unpacking Debian's Rust {version} to {}", prefix.display());
        unpack(workspace, &prefix)?;
    }
    let rustc = prefix.join("usr/bin/rustc");
    let libraries = prefix.join("usr/lib/x86_64-linux-gnu");
    let release = ask(Command::new(&rustc)
        .arg("-V")
        .env("LD_LIBRARY_PATH", &libraries))
    .ok_or_else(|| not_here(format!("{} does not start", rustc.display())))?;
    cargo
        .args(["-Zbuild-std=core"])
        // Its artifacts must not mix with those of the other compiler.
        .arg("--target-dir")
        .arg(workspace.target().join("m4").join("build"))
        // cargo is older or newer than this compiler; the crates say what they need.
        .env("RUSTC", &rustc)
        .env("LD_LIBRARY_PATH", &libraries)
        // -Zbuild-std is not for stable compilers otherwise.
        .env("RUSTC_BOOTSTRAP", "1");
    Ok(format!("core library built by Debian's {}", release.trim()))
}

/// The version that both the compiler and its library's source have.
fn versions() -> Option<String> {
    let compiler = apt::candidate("rustc-web")?;
    (apt::candidate("rust-web-src")? == compiler).then_some(compiler)
}

fn unpack(workspace: &Workspace, prefix: &Path) -> Result<(), Trouble> {
    let broken = |error: std::io::Error| Trouble::Failed(format!("{}: {error}", prefix.display()));
    let packages = prefix.join("packages");
    // What an interrupted run left is in the way.
    let _ = fs::remove_dir_all(prefix);
    fs::create_dir_all(&packages).map_err(broken)?;
    let library = depended("libstd-rust-web-dev", "libstd-rust-web-")?;
    let llvm = depended(&library, "libllvm")?;
    let names = ["rustc-web", &library, "libstd-rust-web-dev", &llvm];
    let mut download = Command::new("apt-get");
    download.current_dir(&packages).args(["download", "-q"]);
    // `apt-get download` drops to the user _apt, who may not write here; it says so and goes on.
    succeed(download.args(names).arg("rust-web-src"))?;
    for name in names {
        let package = find(&packages, name)?;
        succeed(Command::new("dpkg-deb").arg("-x").arg(package).arg(prefix))?;
    }
    let source = find(&packages, "rust-web-src")?;
    let mut shell = Command::new("sh");
    shell.args([
        "-c",
        "dpkg-deb --fsys-tarfile \"$0\" | tar -x -C \"$1\" --wildcards './usr/src/rustc-*/library'",
    ]);
    succeed(shell.arg(source).arg(prefix))?;
    fs::remove_dir_all(&packages).map_err(broken)?;

    // Where the compiler looks for the source, and for a linker.
    let rustlib = prefix.join("usr/lib/rustlib");
    let source = only_entry(&prefix.join("usr/src"))?;
    fs::create_dir_all(rustlib.join("src")).map_err(broken)?;
    link(&source, &rustlib.join("src/rust")).map_err(broken)?;
    if let Some(linker) = own_linker(workspace) {
        let tools = rustlib.join(HOST).join("bin");
        fs::create_dir_all(&tools).map_err(broken)?;
        link(&linker, &tools.join("rust-lld")).map_err(broken)?;
    }
    fs::write(prefix.join("complete"), "").map_err(broken)
}

/// The package that `package` depends on and whose name begins with `begin`.
fn depended(package: &str, begin: &str) -> Result<String, Trouble> {
    let text = ask(Command::new("apt-cache").args(["depends", package])).unwrap_or_default();
    parse_depended(&text, begin)
        .ok_or_else(|| Trouble::Failed(format!("{package} depends on no {begin}*")))
}

fn parse_depended(text: &str, begin: &str) -> Option<String> {
    text.lines()
        .filter_map(|line| line.trim().strip_prefix("Depends: "))
        .find(|name| name.starts_with(begin))
        .map(str::to_owned)
}

/// The file of a package in `directory`: `NAME_VERSION_ARCH.deb`.
fn find(directory: &Path, name: &str) -> Result<PathBuf, Trouble> {
    let prefix = format!("{name}_");
    let files = directory.read_dir().into_iter().flatten().flatten();
    files
        .map(|file| file.path())
        .find(|path| {
            path.file_name()
                .is_some_and(|file| file.to_string_lossy().starts_with(&prefix))
        })
        .ok_or_else(|| Trouble::Failed(format!("apt-get downloaded no {name}")))
}

fn only_entry(directory: &Path) -> Result<PathBuf, Trouble> {
    let mut entries = directory.read_dir().into_iter().flatten().flatten();
    match (entries.next(), entries.next()) {
        (Some(entry), None) => Ok(entry.path()),
        _ => Err(Trouble::Failed(format!(
            "{} holds not exactly one library source",
            directory.display()
        ))),
    }
}

/// The linker that comes with rustup's toolchain; Debian's compiler has none. Libraries need no
/// linker, a firmware image does.
fn own_linker(workspace: &Workspace) -> Option<PathBuf> {
    let sysroot = command::ask(workspace.command("rustc").args(["--print", "sysroot"]))?;
    let bin = Path::new(sysroot.trim())
        .join("lib/rustlib")
        .join(HOST)
        .join("bin");
    Some(bin.join("rust-lld")).filter(|linker| linker.is_file())
}

#[cfg(unix)]
fn link(original: &Path, link: &Path) -> std::io::Result<()> {
    std::os::unix::fs::symlink(original, link)
}

#[cfg(not(unix))]
fn link(_: &Path, _: &Path) -> std::io::Result<()> {
    Err(std::io::ErrorKind::Unsupported.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dependency_is_found_by_the_beginning_of_its_name() {
        let text = "libstd-rust-web-dev\n  Depends: libc6\n  Depends: libstd-rust-web-1.96\n";
        let found = parse_depended(text, "libstd-rust-web-");
        assert_eq!(found.as_deref(), Some("libstd-rust-web-1.96"));
        assert_eq!(parse_depended(text, "libllvm"), None);
    }
}
