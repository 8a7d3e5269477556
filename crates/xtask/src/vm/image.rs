//! The kernel and the initial file system that the virtual machine starts from: Debian's kernel with
//! the few modules that are needed, and busybox. Nothing of it is installed on this machine.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use super::archive::Archive;
use crate::apt;
use crate::command::{ask, succeed};
use crate::step::Trouble;
use crate::workspace::Workspace;

/// Whose dependency is the kernel. Debian's cloud kernel has no CAN.
const KERNEL: &str = "linux-image-amd64";
const BUSYBOX: &str = "busybox-static";

/// Kernel modules, each after those that it needs.
const MODULES: &[&str] = &[
    // The host's files.
    "virtio_ring",
    "virtio",
    "virtio_pci_modern_dev",
    "virtio_pci_legacy_dev",
    "virtio_pci",
    "netfs",
    "fscache",
    "9pnet",
    "9pnet_virtio",
    "9p",
    "overlay",
    // CAN.
    "can",
    "can-raw",
    "can-dev",
    "vcan",
    "slcan",
    "sja1000",
    "kvaser_pci",
];

const INIT: &str = include_str!("init.sh");

/// What QEMU needs to start.
#[derive(Debug)]
pub(super) struct Image {
    pub(super) kernel: PathBuf,
    pub(super) initial: PathBuf,
    /// Of the kernel, as in `6.1.0-53-amd64`.
    pub(super) version: String,
}

/// The image under `target/vm`, which is made if it is not there or not of today's kernel.
///
/// # Errors
/// [`Trouble::Impossible`] where apt does not offer the packages.
pub(super) fn ready(workspace: &Workspace) -> Result<Image, Trouble> {
    let home = workspace.target().join("vm");
    let wanted = wanted()?;
    let image = Image {
        kernel: home.join("vmlinuz"),
        initial: home.join("initial.cpio"),
        version: wanted.kernel.replace("linux-image-", ""),
    };
    // What was made from other packages, or by another init, is made anew.
    let made_from = format!("{}\n{MODULES:?}\n{INIT}", wanted.versions);
    let mark = home.join("made-from.txt");
    if fs::read_to_string(&mark).is_ok_and(|before| before == made_from) {
        return Ok(image);
    }
    println!(
        "making a virtual machine in {} of the Debian packages {} and {BUSYBOX}, which are \
         downloaded and not installed",
        home.display(),
        wanted.kernel
    );
    let unpacked = home.join("unpacked");
    let _ = fs::remove_dir_all(&unpacked);
    make(&image, &wanted, &unpacked)?;
    let broken = |error: std::io::Error| Trouble::Failed(format!("{}: {error}", home.display()));
    fs::remove_dir_all(&unpacked).map_err(broken)?;
    fs::write(mark, made_from).map_err(broken)?;
    Ok(image)
}

/// The package of the kernel, and what apt would fetch.
#[derive(Debug)]
struct Wanted {
    kernel: String,
    versions: String,
}

fn wanted() -> Result<Wanted, Trouble> {
    let mut wanted = look_up();
    if wanted.is_none() && apt::may_install() {
        apt::update()?;
        wanted = look_up();
    }
    wanted.ok_or_else(|| {
        Trouble::impossible(
            format!("apt offers no {KERNEL} and {BUSYBOX}"),
            "run this on Debian for x86-64, as root or after `apt-get update`",
        )
    })
}

fn look_up() -> Option<Wanted> {
    let depends = ask(Command::new("apt-cache").args(["depends", KERNEL]))?;
    let kernel = depends
        .lines()
        .filter_map(|line| line.trim().strip_prefix("Depends: "))
        .find(|name| name.starts_with("linux-image-"))?
        .to_owned();
    let versions = format!(
        "{kernel} {}, {BUSYBOX} {}",
        apt::candidate(&kernel)?,
        apt::candidate(BUSYBOX)?
    );
    Some(Wanted { kernel, versions })
}

fn make(image: &Image, wanted: &Wanted, unpacked: &Path) -> Result<(), Trouble> {
    let broken =
        |error: std::io::Error| Trouble::Failed(format!("{}: {error}", unpacked.display()));
    fs::create_dir_all(unpacked).map_err(broken)?;
    let mut download = Command::new("apt-get");
    download.current_dir(unpacked).args(["download", "-q"]);
    // `apt-get download` drops to the user _apt, who may not write here; it says so and goes on.
    succeed(download.args([&wanted.kernel, BUSYBOX]))?;
    let mut patterns = vec!["./boot/vmlinuz-*".to_owned()];
    // A `-` in a module's name is the same as a `_`, and the file has either; new kernels' modules
    // are compressed, which busybox's insmod knows.
    patterns.extend(MODULES.iter().map(|module| format!("*/{module}.ko*")));
    unpack(unpacked, &wanted.kernel, &patterns)?;
    unpack(unpacked, BUSYBOX, &["*/busybox".to_owned()])?;

    let kernel = find(unpacked, |name| name.starts_with("vmlinuz-"))
        .ok_or_else(|| lacks(&wanted.kernel, "vmlinuz"))?;
    fs::copy(kernel, &image.kernel).map_err(broken)?;
    let mut archive = Archive::new();
    for directory in [
        "bin", "dev", "host", "layer", "modules", "proc", "root", "sys",
    ] {
        archive.directory(directory);
    }
    archive.program("init", INIT.as_bytes());
    let busybox =
        find(unpacked, |name| name == "busybox").ok_or_else(|| lacks(BUSYBOX, "busybox"))?;
    archive.program("bin/busybox", &fs::read(busybox).map_err(broken)?);
    let mut order = String::new();
    for module in MODULES {
        let plain = format!("{module}.ko");
        let file = find(unpacked, |name| {
            name == plain || name.starts_with(&format!("{plain}."))
        })
        .ok_or_else(|| lacks(&wanted.kernel, &plain))?;
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        archive.file(
            &format!("modules/{name}"),
            &fs::read(&file).map_err(broken)?,
        );
        order.push_str(&name);
        order.push('\n');
    }
    archive.file("modules/order", order.as_bytes());
    fs::write(&image.initial, archive.finish()).map_err(broken)
}

fn lacks(package: &str, file: &str) -> Trouble {
    Trouble::Failed(format!("the Debian package {package} holds no {file}"))
}

/// Unpacks files of a package that was downloaded into `directory`.
fn unpack(directory: &Path, package: &str, patterns: &[String]) -> Result<(), Trouble> {
    let begin = format!("{package}_");
    let file = find(directory, |name| name.starts_with(&begin))
        .ok_or_else(|| Trouble::Failed(format!("apt-get downloaded no {package}")))?;
    let mut shell = Command::new("sh");
    shell.args([
        "-c",
        "package=$1; shift; dpkg-deb --fsys-tarfile \"$package\" | tar -x -C \"$0\" --wildcards \"$@\"",
    ]);
    succeed(shell.arg(directory).arg(file).args(patterns)).map(|_| ())
}

/// The first file under `directory` whose name is wanted.
fn find(directory: &Path, wanted: impl Fn(&str) -> bool) -> Option<PathBuf> {
    let mut directories = vec![directory.to_owned()];
    while let Some(directory) = directories.pop() {
        for entry in directory.read_dir().into_iter().flatten().flatten() {
            let path = entry.path();
            if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
                directories.push(path);
            } else if wanted(&entry.file_name().to_string_lossy()) {
                return Some(path);
            }
        }
    }
    None
}
