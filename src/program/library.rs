//! Where the sub-programs of a program are found.
//!
//! In: the main program, names and paths of calls. Out: [`Found`] programs, each file opened once. Upper and lower case are the same.
//! The order is the control's (programming manual 12/2019, p. 559), with the given folders in it:
//!
//! 1. the archive that holds the calling program, then the one that holds the main program;
//! 2. the folder of the main program: NAME, NAME.SPF, NAME.MPF;
//! 3. the given folders, in order, in the same way;
//! 4. SPF.DIR, then what CALLPATH gave, then CUS.DIR, CMA.DIR and CST.DIR, each inside the folders above and beside the
//!    workpiece folder (`PART.WPD`, also in `WKS.DIR`) or the `MPF.DIR` that holds the main program; MPF.DIR last;
//! 5. archives (`*.ARC`) in the folders of 2 and 3;
//! 6. shipped programs.
//!
//! Files may carry the control's spelling (`_N_NAME_SPF`). A path (`/_N_SPF_DIR/_N_NAME_SPF`) is followed inside the same folders;
//! where it leads nowhere, the name alone is searched, because on this machine the folders may be others. Does not execute.

use super::archive::{folders_of, split_name};
use super::source::ProgramSource;
use super::{OpenedProgram, ProgramId};
use crate::base::Diagnostic;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Files of one run.
const FILES_MAX: usize = 4096;
/// Entries of a folder that are looked at.
const ENTRIES_MAX: usize = 100_000;
/// Extensions of programs, in the order in which they are tried.
const EXTENSIONS: [&str; 3] = ["", "SPF", "MPF"];
/// Folders of sub-programs of the control: before CALLPATH, and after it.
const FIRST_FOLDERS: [&str; 1] = ["SPF.DIR"];
const LATER_FOLDERS: [&str; 4] = ["CUS.DIR", "CMA.DIR", "CST.DIR", "MPF.DIR"];

/// Programs inside the binary: name and text.
pub type Shipped = &'static [(&'static str, &'static str)];

/// Number of a program in its library; 0 is the main program. Two programs of one file have two numbers, and one [`ProgramId`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct UnitId(pub usize);

/// A program that was found.
#[derive(Clone, Debug)]
pub struct Found {
    /// Its number.
    pub unit: UnitId,
    /// Its file, if it was opened for the first time.
    pub opened: Option<OpenedProgram>,
}

/// All programs of a run.
#[derive(Clone, Debug)]
pub struct Library {
    units: Vec<(ProgramId, ProgramSource)>,
    /// One section of every file.
    files: Vec<ProgramSource>,
    /// Answers, by what was asked; from which unit, because of archives.
    known: BTreeMap<(UnitId, String), Option<UnitId>>,
    listings: BTreeMap<PathBuf, Arc<Listing>>,
    /// Files that were opened from the disk, also archives that held nothing.
    opened: BTreeMap<PathBuf, ProgramSource>,
    call_path: Option<String>,
    folders: Vec<PathBuf>,
    shipped: Shipped,
}

/// What is in a folder, by name and extension in capitals.
type Listing = BTreeMap<(String, String), PathBuf>;

impl Library {
    /// Knows the main program, the folders that are searched after its own, and the programs that are searched last.
    pub fn new(main: ProgramSource, folders: Vec<PathBuf>, shipped: Shipped) -> Self {
        Self {
            folders,
            shipped,
            units: vec![(ProgramId(0), main.clone())],
            files: vec![main],
            known: BTreeMap::new(),
            listings: BTreeMap::new(),
            opened: BTreeMap::new(),
            call_path: None,
        }
    }

    /// A program.
    pub fn source(&self, unit: UnitId) -> &ProgramSource {
        &self.units[unit.0.min(self.units.len() - 1)].1
    }

    /// The file of a program.
    pub fn program(&self, unit: UnitId) -> ProgramId {
        self.units[unit.0.min(self.units.len() - 1)].0
    }

    /// CALLPATH: one more folder to search; `None` forgets it.
    pub fn set_call_path(&mut self, path: Option<String>) {
        self.call_path = path;
        // What was not found may be there now.
        self.known.retain(|_, found| found.is_some());
    }

    /// The sub-program of that name, or of that path, as seen from the program `from`; `None` where there is none.
    pub fn find(&mut self, name: &str, from: UnitId) -> Result<Option<Found>, Diagnostic> {
        let asked = (from, name.trim().to_ascii_uppercase());
        if let Some(known) = self.known.get(&asked) {
            return Ok(known.map(|unit| Found { unit, opened: None }));
        }
        let found = self.search(&asked.1.replace('\\', "/"), from)?;
        if self.known.len() < FILES_MAX {
            self.known.insert(asked, found.as_ref().map(|found| found.unit));
        }
        Ok(found)
    }

    /// Names of programs at hand, for help texts.
    pub fn names(&mut self) -> Vec<String> {
        let mut names: Vec<String> = Vec::new();
        for file in &self.files {
            names.extend(file.sections().iter().map(|section| section.name.to_string()));
        }
        for folder in self.own_folders() {
            let listing = self.listing(&folder);
            names.extend(listing.keys().filter(|(_, ext)| EXTENSIONS.contains(&ext.as_str())).map(|key| key.0.clone()));
        }
        names.retain(|name| !name.is_empty());
        names
    }

    fn search(&mut self, asked: &str, from: UnitId) -> Result<Option<Found>, Diagnostic> {
        let (path, file_name) = asked.rsplit_once('/').unwrap_or(("", asked));
        let (name, extension) = split_name(file_name);
        let folders = folders_of(path);
        if name.is_empty() {
            return Ok(None);
        }
        for file in [self.source(from).clone(), self.files[0].clone()] {
            if let Some(found) = self.in_archive(&file, &name, &extension, &folders) {
                return Ok(Some(found));
            }
        }
        if !folders.is_empty() {
            for root in self.roots() {
                if let Some(folder) = self.walk(&root, &folders)
                    && let Some(found) = self.in_folder(&folder, &name, &extension)?
                {
                    return Ok(Some(found));
                }
            }
        }
        for folder in self.search_path() {
            if let Some(found) = self.in_folder(&folder, &name, &extension)? {
                return Ok(Some(found));
            }
        }
        for folder in self.own_folders() {
            if let Some(found) = self.in_archives_of(&folder, &name, &extension)? {
                return Ok(Some(found));
            }
        }
        self.in_binary(&name, &extension)
    }

    /// Folders of the main program and given ones.
    fn own_folders(&self) -> Vec<PathBuf> {
        let main = &self.files[0];
        main.folder().map(Path::to_owned).into_iter().chain(self.folders.iter().cloned()).collect()
    }

    /// Folders that may hold the folders of the control.
    fn roots(&self) -> Vec<PathBuf> {
        let mut roots = self.own_folders();
        let mut folder = self.files[0].folder().and_then(|folder| folder.canonicalize().ok());
        for _ in 0..2 {
            let Some(inner) = folder else { break };
            let name = inner.file_name().map(|name| split_name(&name.to_string_lossy()));
            if !name.is_some_and(|(_, extension)| extension == "WPD" || extension == "DIR") {
                break;
            }
            let around = inner.parent().map(Path::to_owned);
            roots.extend(around.clone());
            folder = around;
        }
        roots
    }

    fn search_path(&mut self) -> Vec<PathBuf> {
        let mut path = self.own_folders();
        let roots = self.roots();
        let mut add = |library: &mut Self, name: &str| {
            for root in &roots {
                path.extend(library.walk(root, &[name.to_owned()]));
            }
        };
        FIRST_FOLDERS.iter().for_each(|name| add(self, name));
        if let Some(call_path) = self.call_path.clone() {
            let folders = folders_of(&call_path.replace('\\', "/"));
            for root in self.roots() {
                path.extend(self.walk(&root, &folders));
            }
        }
        let mut add = |library: &mut Self, name: &str| {
            for root in &roots {
                path.extend(library.walk(root, &[name.to_owned()]));
            }
        };
        LATER_FOLDERS.iter().for_each(|name| add(self, name));
        path
    }

    /// A folder inside a folder.
    fn walk(&mut self, root: &Path, folders: &[String]) -> Option<PathBuf> {
        let mut folder = root.to_owned();
        for name in folders {
            let (name, extension) = split_name(name);
            folder = self.listing(&folder).get(&(name, extension)).filter(|path| path.is_dir())?.clone();
        }
        Some(folder)
    }

    fn listing(&mut self, folder: &Path) -> Arc<Listing> {
        if let Some(known) = self.listings.get(folder) {
            return known.clone();
        }
        let mut listing = Listing::new();
        let entries = std::fs::read_dir(folder).into_iter().flatten().flatten().take(ENTRIES_MAX);
        let mut paths: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
        // A folder lists its entries in any order: of two that differ in case only, the first in the alphabet counts.
        paths.sort();
        for path in paths {
            let Some(name) = path.file_name() else { continue };
            listing.entry(split_name(&name.to_string_lossy())).or_insert(path);
        }
        let listing = Arc::new(listing);
        self.listings.insert(folder.to_owned(), listing.clone());
        listing
    }

    fn in_archive(&mut self, file: &ProgramSource, name: &str, extension: &str, folders: &[String]) -> Option<Found> {
        let fits = |with_path: bool| {
            file.sections().iter().position(|section| {
                &*section.name == name
                    && (extension.is_empty() || &*section.extension == extension)
                    && (!with_path || folders.is_empty() || section.folders == folders)
            })
        };
        let section = file.at_section(fits(true).or_else(|| fits(false))?)?;
        Some(self.enter(section))
    }

    fn in_folder(&mut self, folder: &Path, name: &str, extension: &str) -> Result<Option<Found>, Diagnostic> {
        let listing = self.listing(folder);
        let wanted: &[&str] = if extension.is_empty() { &EXTENSIONS } else { &[extension] };
        for extension in wanted {
            let path = listing.get(&(name.to_owned(), (*extension).to_owned()));
            if let Some(path) = path.filter(|path| path.is_file()) {
                return self.open(path).map(Some);
            }
        }
        Ok(None)
    }

    fn in_archives_of(&mut self, folder: &Path, name: &str, extension: &str) -> Result<Option<Found>, Diagnostic> {
        let listing = self.listing(folder);
        for (_, path) in listing.iter().filter(|((_, known), path)| known == "ARC" && path.is_file()) {
            let archive = self.file_at(path)?;
            if let Some(found) = self.in_archive(&archive, name, extension, &[]) {
                return Ok(Some(found));
            }
        }
        Ok(None)
    }

    fn in_binary(&mut self, name: &str, extension: &str) -> Result<Option<Found>, Diagnostic> {
        let shipped = self.shipped;
        let fits = |file_name: &str| {
            let (known, known_extension) = split_name(file_name);
            known == name && (extension.is_empty() || extension == known_extension)
        };
        let Some((file_name, text)) = shipped.iter().find(|(file_name, _)| fits(file_name)) else { return Ok(None) };
        Ok(Some(self.enter(ProgramSource::from_bytes(file_name, text.as_bytes()))))
    }

    fn open(&mut self, path: &Path) -> Result<Found, Diagnostic> {
        let source = self.file_at(path)?;
        Ok(self.enter(source))
    }

    /// A file, opened once.
    fn file_at(&mut self, path: &Path) -> Result<ProgramSource, Diagnostic> {
        // The main program may call itself.
        if self.files[0].path().is_some_and(|main| is_same_path(main, path)) {
            return Ok(self.files[0].clone());
        }
        if let Some(known) = self.opened.get(path) {
            return Ok(known.clone());
        }
        if self.opened.len() >= FILES_MAX {
            let message = format!("`{}` would be program file number {}", path.display(), FILES_MAX + 2);
            return Err(Diagnostic::error(super::codes::UNREADABLE, message).help("split the run"));
        }
        let source = ProgramSource::from_file(path)?;
        self.opened.insert(path.to_owned(), source.clone());
        Ok(source)
    }

    /// The number of a program; a new one where it has none.
    fn enter(&mut self, source: ProgramSource) -> Found {
        let same = |known: &ProgramSource| known.is_same_file(&source) && known.section() == source.section();
        if let Some(known) = self.units.iter().position(|(_, known)| same(known)) {
            return Found { unit: UnitId(known), opened: None };
        }
        let file = self.files.iter().position(|known| known.is_same_file(&source));
        let is_new = file.is_none();
        let program = ProgramId(file.unwrap_or(self.files.len()) as u16);
        if is_new {
            self.files.push(source.clone());
        }
        self.units.push((program, source.clone()));
        Found { unit: UnitId(self.units.len() - 1), opened: is_new.then(|| source.opened(program)) }
    }
}

fn is_same_path(one: &Path, other: &Path) -> bool {
    one == other || matches!((one.canonicalize(), other.canonicalize()), (Ok(one), Ok(other)) if one == other)
}
