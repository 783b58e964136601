//! Words of the language that are not built yet and would change the motion or the flow: an error, with the reason.
//!
//! In: nothing. Out: [`NOT_BUILT`]. A word that can be left out honestly, with a warning, stands in `not_acted_on` instead.

/// Words with what is missing, in groups.
pub(super) const NOT_BUILT: &[(&[&str], &str)] = &[
    (&["ASPLINE", "BSPLINE", "CSPLINE", "POLY", "PO", "PW", "SD", "PL"], "splines and polynomials are not built yet"),
    (&["CIP", "CT", "AR", "I1", "J1", "K1"], "this form of circle is not built yet: use G2 or G3 with I, J, K or CR"),
    (&["AP", "RP", "G110", "G111", "G112"], "polar coordinates are not built yet"),
    (&["G33", "G34", "G35", "G63", "G331", "G332"], "threads are not built yet"),
    (
        &[
            "G93", "G95", "G96", "G97", "G931", "G942", "G952", "G961", "G962", "G971", "G972", "G973", "FB", "FZ",
            "FLIN", "FCUB",
        ],
        "this kind of feed is not built yet: use F in mm/min with G94",
    ),
    (&["RND", "RNDM", "CHF", "CHR", "FRC", "FRCM"], "fillets and chamfers are not built yet"),
    (
        &[
            "AROT", "ROTS", "AROTS", "CROTS", "RPL", "ASCALE", "AMIRROR", "G58", "G59", "CTRANS", "CROT", "CSCALE",
            "CMIRROR", "CFINE", "TOFRAME", "TOROT", "TOROTX", "TOROTY", "TOROTZ", "TOFRAMEX", "TOFRAMEY", "TOFRAMEZ",
            "PAROT", "MEAFRAME",
        ],
        "rotated, scaled and mirrored frames are not built yet: only TRANS and ATRANS",
    ),
    (&["POS", "POSA", "POSP", "WAITP", "OS", "OSP1", "OSP2"], "positioning axes are not built yet"),
    (&["G25", "G26"], "working-area and spindle limits from the program are not built yet"),
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
    (&["CALL", "PCALL", "ISOCALL", "REPEATB"], "sub-programs and block repetition are not built yet"),
    (&["DIAMON", "DIAM90"], "diameter programming is not built yet"),
    (&["AXIS", "FRAME"], "variables of type AXIS and FRAME are not built yet"),
    (&["WRITE", "READ", "DELETE", "ISFILE"], "reading and writing files from the program is not built yet"),
    (&["SETAL"], "alarms from the program are not built yet"),
    (&["MEAS", "MEAW", "MEAC"], "measuring is not built yet"),
    (&["SPN", "SPP", "SON", "PON", "SPOF"], "punching and nibbling are not built yet"),
];

/// Functions of expressions that are not built.
pub(super) const FUNCTIONS_NOT_BUILT: &[&str] = &[
    "STRLEN", "SUBSTR", "TOUPPER", "TOLOWER", "INDEX", "RINDEX", "MINDEX", "NUMBER", "ISNUMBER", "AXNAME", "ISAXIS",
    "AXSTRING", "ISVAR",
];
