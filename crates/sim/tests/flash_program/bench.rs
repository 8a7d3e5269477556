//! Images, banks and what a master does to bring a program in.
#![allow(unreachable_pub, reason = "a test's module")]

use canopen::Abort;
use drive::flash::Region;
use drive::program::{Action, Banks, ImageHeader, Program, ProgramStore, Version};
use embedded_storage::nor_flash::NorFlash;
use sim::MemoryFlash;

pub const SMALL_BANK: u32 = 1024;

pub const PRODUCT: u32 = 0x5033;

pub fn banks<F: NorFlash>(flash: &F, bytes: u32) -> Banks {
    let first = Region::new(0, bytes);
    Banks::new(first, Region::new(bytes, bytes), flash).unwrap()
}

pub fn image_for(product: u32, number: u32, length: usize) -> Vec<u8> {
    let byte = |at: usize| (at as u32).wrapping_mul(37).wrapping_add(number * 101) as u8;
    let body: Vec<u8> = (0..length).map(byte).collect();
    let version = Version::new(&format!("1.{number}")).unwrap();
    let mut image = ImageHeader::of(product, version, &body).bytes().to_vec();
    image.extend(body);
    image
}

pub fn image(number: u32, length: usize) -> Vec<u8> {
    image_for(PRODUCT, number, length)
}

/// The image that the next start runs, read from where a boot loader reads it.
pub fn started<const PAGE: usize, const SECTOR: usize>(
    flash: &mut MemoryFlash<PAGE, SECTOR>,
    banks: &Banks,
) -> Option<Vec<u8>> {
    let program: Program = banks.newest(flash).unwrap()?;
    let at = program.at as usize;
    assert_eq!(at % 512, 0);
    let mut image = program.image.bytes().to_vec();
    image.extend(&flash.bytes()[at..at + program.image.body_bytes as usize]);
    assert_eq!(drive::program::check_image(&image), Ok(program.image));
    Some(image)
}

/// Clears the memory for a new program.
pub fn clear<F: NorFlash>(flash: &mut F, store: &mut ProgramStore) -> Result<(), Abort> {
    store.control(0)?;
    assert_eq!(store.control(3)?, Action::Clear);
    assert_eq!(store.status(), 1);
    while store.erase_sector(flash)? {
        assert_eq!(store.status(), 1);
    }
    assert_eq!((store.status(), store.control_value()), (0, 3));
    Ok(())
}

/// Downloads `image` in pieces of `piece` bytes.
pub fn download<F: NorFlash>(
    flash: &mut F,
    store: &mut ProgramStore,
    image: &[u8],
    piece: usize,
) -> Result<(), Abort> {
    store.begin(Some(image.len() as u32))?;
    let mut at = 0;
    for bytes in image.chunks(piece) {
        store.write(flash, at, bytes)?;
        assert_eq!((store.status(), store.control_value()), (1, 3));
        at += bytes.len() as u32;
    }
    store.finish(flash)
}

/// All that a master does to bring `image` in; the drive has just started.
pub fn update<F: NorFlash>(
    flash: &mut F,
    banks: &Banks,
    image: &[u8],
    piece: usize,
) -> Result<(), Abort> {
    let mut store = ProgramStore::open(flash, *banks, PRODUCT).map_err(|_| Abort::HARDWARE)?;
    clear(flash, &mut store)?;
    download(flash, &mut store, image, piece)?;
    assert_eq!((store.status(), store.control_value()), (0, 0));
    let stated = u32::from_le_bytes(*image[4..].first_chunk().unwrap());
    assert_eq!(store.identification(), stated);
    assert_eq!(store.control(1), Ok(Action::Start));
    Ok(())
}

/// A flash on which `number` programs were installed one after another, and the last of them.
pub fn prepared<const PAGE: usize, const SECTOR: usize>(
    bank_bytes: u32,
    number: u32,
    length: usize,
) -> (MemoryFlash<PAGE, SECTOR>, Banks, Option<Vec<u8>>) {
    let mut flash = MemoryFlash::new(2 * bank_bytes as usize);
    let banks = banks(&flash, bank_bytes);
    let mut last = None;
    for number in 0..number {
        let image = image(number, length);
        update(&mut flash, &banks, &image, 7).unwrap();
        last = Some(image);
    }
    assert_eq!(started(&mut flash, &banks), last);
    (flash, banks, last)
}
