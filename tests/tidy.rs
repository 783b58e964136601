//! Keeps the house in order: every rule that matters is a test, because a rule that is only written down decays.
//!
//! In: the text of this repository's sources, documents and machine files. Out: every fault as `file:line: rule: reason`. It
//! reads text and nothing else: it neither links the library nor runs the program, so that it says what is wrong even where the
//! code does not work. Each rule is also tried on a bad snippet (`tidy/snippets.rs`): a rule that cannot fail is no rule.

#[path = "tidy/documents.rs"]
mod documents;
#[path = "tidy/house.rs"]
mod house;
#[path = "tidy/scan.rs"]
mod scan;
#[path = "tidy/snippets.rs"]
mod snippets;
#[path = "tidy/words.rs"]
mod words;

use scan::{Fault, Repository};

/// Fails with all faults of one rule, so that one run shows everything that there is to mend.
fn assert_tidy(faults: Vec<Fault>) {
    let list: Vec<String> = faults.iter().map(Fault::to_string).collect();
    assert!(list.is_empty(), "{} fault(s):\n{}\n", list.len(), list.join("\n"));
}

#[test]
fn rooms_import_only_rooms_above_them() {
    assert_tidy(house::imports(&Repository::here()));
}

#[test]
fn every_source_file_opens_with_what_it_does() {
    assert_tidy(house::headers(&Repository::here()));
}

#[test]
fn files_and_functions_can_be_read_in_one_sitting() {
    assert_tidy(house::lengths(&Repository::here()));
}

#[test]
fn there_is_no_room_for_leftovers() {
    assert_tidy(house::names(&Repository::here()));
}

#[test]
fn every_source_file_is_part_of_the_program() {
    assert_tidy(house::dead_files(&Repository::here()));
}

#[test]
fn every_float_name_ends_in_its_unit() {
    assert_tidy(words::float_names(&Repository::here()));
}

#[test]
fn every_key_of_a_machine_file_ends_in_its_unit() {
    assert_tidy(words::machine_keys(&Repository::here()));
}

#[test]
fn units_are_converted_in_one_place() {
    assert_tidy(words::conversions(&Repository::here()));
}

#[test]
fn every_citation_is_in_the_references() {
    assert_tidy(words::citations(&Repository::here()));
}

#[test]
fn the_library_neither_prints_nor_reads_the_environment() {
    assert_tidy(words::forbidden(&Repository::here()));
}

#[test]
fn recordings_do_not_depend_on_the_library_of_the_system() {
    assert_tidy(words::system_functions(&Repository::here()));
}

#[test]
fn no_path_of_a_build_machine_is_committed() {
    assert_tidy(words::machine_paths(&Repository::here()));
}

#[test]
fn links_between_documents_lead_somewhere() {
    assert_tidy(documents::links(&Repository::here()));
}

#[test]
fn the_index_leads_to_every_document() {
    assert_tidy(documents::index(&Repository::here()));
}
