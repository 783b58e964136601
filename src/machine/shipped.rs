//! The machines inside the binary, so that an installed program works in an empty folder.
//!
//! In: nothing. Out: names and TOML texts of `machines/*.toml`.

/// The machine without `-m`: three linear axes.
pub const DEFAULT_MACHINE: &str = "spinner_mvc850";

const SHIPPED: &[(&str, &str)] = &[
    ("spinner_mvc850", include_str!("../../machines/spinner_mvc850.toml")),
    ("huron_kx10", include_str!("../../machines/huron_kx10.toml")),
    ("mikron_ucp710", include_str!("../../machines/mikron_ucp710.toml")),
    ("huron_kx8_five", include_str!("../../machines/huron_kx8_five.toml")),
    ("xyzbc", include_str!("../../machines/xyzbc.toml")),
];

/// Names and texts of the shipped machines.
pub fn shipped() -> &'static [(&'static str, &'static str)] {
    SHIPPED
}

/// The shipped machine of that name, with or without `.toml`, case-blind.
pub(super) fn shipped_text(name: &str) -> Option<(&'static str, &'static str)> {
    let name = name.strip_suffix(".toml").unwrap_or(name);
    SHIPPED.iter().copied().find(|(known, _)| known.eq_ignore_ascii_case(name))
}
