//! Words of the language that are not built yet and would change the motion or the flow: an error, with the reason.
//!
//! In: nothing. Out: [`NOT_BUILT`]. A word that can be left out honestly, with a warning, stands in `not_acted_on` instead.

/// Words with what is missing, in groups.
pub(super) const NOT_BUILT: &[(&[&str], &str)] = &[
    (&["FZ"], "a feed for each tooth is not built yet: use F in mm/min with G94"),
    (
        &["TOFRAME", "TOROT", "TOROTX", "TOROTY", "TOROTZ", "TOFRAMEX", "TOFRAMEY", "TOFRAMEZ", "PAROT"],
        "frames from the orientation of the tool are not built yet",
    ),
    (&["OS", "OSP1", "OSP2"], "oscillation is not built yet"),
    (&["G74", "G75"], "approaching fixed points is not built yet"),
    (
        &[
            "G140", "G141", "G142", "G143", "G147", "G148", "G247", "G248", "G340", "G341", "G347", "G348", "DISR",
            "DISCL", "OFFN",
        ],
        "soft approach and retraction are not built yet",
    ),
    (&["G291"], "ISO mode is not built: write the program in SINUMERIK mode"),
    (
        &[
            "TRAORI", "TRACYL", "TRANSMIT", "TRAANG", "TRACON", "TRAFOON", "PTP", "A2", "B2", "C2", "A3", "B3", "C3",
            "A4", "B4", "C4", "A5", "B5", "C5", "LEAD", "TILT", "THETA",
        ],
        "kinematic transformations are not built yet: without them the axes would not go where the program says",
    ),
    (&["DIAMON", "DIAM90"], "diameter programming is not built yet"),
    (&["WRITE", "READ", "DELETE", "ISFILE"], "reading and writing files from the program is not built yet"),
    (&["MEAS", "MEAW", "MEAC"], "measuring is not built yet"),
    (&["SPN", "SPP", "SON", "PON", "SPOF"], "punching and nibbling are not built yet"),
];

/// Functions of expressions that are not built.
pub(super) const FUNCTIONS_NOT_BUILT: &[&str] = &["MEAFRAME", "GETMDACT", "SPI", "GETTCOR"];
