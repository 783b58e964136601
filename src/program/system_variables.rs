//! The system variables that programs may name.
//!
//! In: a name. Out: its [`SystemVariable`]: what it is, whether reading it needs the main run, whether it can be written.
//! `docs/system-variables.md` lists exactly these (a test compares). Does not know values: those are the interpreter's.

/// A system variable.
#[derive(Debug, PartialEq, Eq)]
pub struct SystemVariable {
    /// Name in capitals, with its `$`.
    pub name: &'static str,
    /// Meaning, for the documentation.
    pub meaning: &'static str,
    /// Its value is that of the main run: reading it empties the look-ahead, as STOPRE does.
    pub main_run: bool,
    /// A program may write it.
    pub writable: bool,
}

impl SystemVariable {
    /// The variable of that name (in capitals).
    pub fn find(name: &str) -> Option<&'static Self> {
        SYSTEM_VARIABLES.iter().find(|variable| variable.name == name)
    }
}

const fn prepared(name: &'static str, meaning: &'static str) -> SystemVariable {
    SystemVariable { name, meaning, main_run: false, writable: false }
}

const fn written(name: &'static str, meaning: &'static str) -> SystemVariable {
    SystemVariable { name, meaning, main_run: false, writable: true }
}

const fn main_run(name: &'static str, meaning: &'static str) -> SystemVariable {
    SystemVariable { name, meaning, main_run: true, writable: false }
}

const fn main_run_written(name: &'static str, meaning: &'static str) -> SystemVariable {
    SystemVariable { name, meaning, main_run: true, writable: true }
}

/// All of them, grouped as in the documentation.
pub static SYSTEM_VARIABLES: &[SystemVariable] = &[
    prepared("$P_F", "programmed F, in its unit"),
    prepared("$P_S", "programmed S, rpm"),
    prepared("$P_EP", "[axis] programmed end position in the workpiece, mm or deg"),
    prepared("$P_EPM", "[axis] programmed end position of the machine axis, mm or deg"),
    prepared("$P_GG", "[group] number of the active G function in its group"),
    prepared("$P_CTOL", "programmed CTOL, mm; -1 where none is programmed"),
    prepared("$P_OTOL", "programmed OTOL, deg; -1 where none is programmed"),
    prepared("$P_ATOL", "[axis] programmed ATOL, mm or deg; -1 where none is programmed"),
    prepared("$P_STOLF", "programmed STOLF; -1 where none is programmed"),
    prepared("$P_AXN1", "first geometry axis"),
    prepared("$P_AXN2", "second geometry axis"),
    prepared("$P_AXN3", "third geometry axis"),
    prepared("$P_PROG", "[level] name of the program at that level; 0 is the main program"),
    prepared("$P_STACK", "level of the program in execution; 0 is the main program"),
    prepared("$P_SUBPAR", "[n] TRUE if parameter n of this call was given"),
    prepared("$P_SIM", "TRUE: this is a simulation"),
    prepared("$P_SEARCH", "FALSE: no block search"),
    prepared("$P_ISTEST", "FALSE: no program test"),
    prepared("$P_DRYRUN", "FALSE: no dry run"),
    prepared("$P_MSNUM", "number of the master spindle"),
    prepared("$P_NUM_SPINDLES", "number of spindles: 1"),
    prepared("$P_CHANNO", "number of the channel: 1"),
    prepared("$P_SEARCHL", "0: no block search"),
    prepared("$P_ACTID", "[n] FALSE: no modal synchronised action is active"),
    prepared("$P_LIFTFAST", "FALSE: no rapid lift"),
    prepared("$P_TC", "0: no tool carrier"),
    prepared("$P_OFFN", "0: no offset normal to the contour"),
    prepared("$P_TOOL", "active D"),
    prepared("$P_TOOLNO", "number of the active tool"),
    prepared("$P_TOOLR", "radius of the active tool with wear, mm"),
    prepared("$P_TOOLL", "[1..3] length of the active tool with wear, mm"),
    prepared("$P_AD", "[n] datum n of the active tool edge, as $TC_DPn"),
    written("$P_UIFR", "[n] settable frame: 1 is G54; [n,axis,TR|FI|RT|SC|MI] a component"),
    written("$P_PFRAME", "programmable frame"),
    prepared("$P_UIFRNUM", "number of the active settable frame: 0 is G500, 1 is G54"),
    written("$P_IFRAME", "active settable frame"),
    written("$P_BFRAME", "first basic frame"),
    written("$P_UBFR", "first basic frame, in the data management"),
    prepared("$P_ACTFRAME", "the whole chain of frames"),
    main_run("$AA_IM", "[axis] set-point of the machine axis, mm or deg"),
    main_run("$AA_IB", "[axis] set-point in the basic coordinate system (tool tip), mm or deg"),
    main_run("$AA_IW", "[axis] set-point in the workpiece, mm or deg"),
    main_run("$AA_VACTM", "[axis] set-point velocity of the machine axis: 0, because the path rests"),
    main_run("$AA_VACTB", "[axis] the same in the basic coordinate system: 0"),
    main_run("$AA_VACTW", "[axis] the same in the workpiece: 0"),
    main_run("$AA_DTEB", "[axis] way to the end of the block in the basic coordinate system: 0"),
    main_run("$AA_DTEW", "[axis] the same in the workpiece: 0"),
    main_run("$AA_SOFTENDN", "[axis] lower software limit, mm or deg: the travel of the machine file"),
    main_run("$AA_SOFTENDP", "[axis] upper software limit, mm or deg"),
    main_run("$AC_VACTB", "set-point velocity on the path: 0, because the path rests"),
    main_run("$AC_VACTW", "the same in the workpiece: 0"),
    main_run("$AC_DTEB", "way to the end of the block: 0"),
    main_run("$AC_DTEW", "the same in the workpiece: 0"),
    main_run("$AC_TIME", "time since the block began, s: 0, because the block that reads it begins at rest"),
    main_run("$AC_TIMEC", "the same in interpolator cycles"),
    main_run_written("$AC_TIMER", "[n] clock that counts from the value written, s; a negative value stops it"),
    main_run("$AC_CYCLE_TIME", "time since the program began, s"),
    main_run("$AC_OPERATING_TIME", "the same: all automatic operation"),
    main_run("$AC_CUTTING_TIME", "time of feed motions, s"),
    main_run("$AC_ACT_PROG_NET_TIME", "time since the program began, s"),
    main_run("$AC_OLD_PROG_NET_TIME", "0: no program ran before"),
    main_run("$AN_POWERON_TIME", "time since the control was switched on, min: since the program began"),
    main_run("$AN_SETUP_TIME", "the same"),
    main_run_written("$AC_ACTUAL_PARTS", "counter of the program: nothing counts but the program"),
    main_run_written("$AC_REQUIRED_PARTS", "the same"),
    main_run_written("$AC_TOTAL_PARTS", "the same"),
    main_run_written("$AC_SPECIAL_PARTS", "the same"),
    main_run_written("$AC_MARKER", "[n] whole number for the program's own use"),
    main_run_written("$AC_PARAM", "[n] REAL for the program's own use"),
    main_run_written("$A_IN", "[n] digital input: as written before, else FALSE: there is no PLC"),
    main_run_written("$A_OUT", "[n] digital output: kept, and not connected to anything"),
    main_run_written("$A_INA", "[n] analog input: as written before, else 0"),
    main_run_written("$A_OUTA", "[n] analog output: kept"),
    main_run_written("$A_DBB", "[n] byte of the PLC, 0 to 255: as written before, else 0"),
    main_run_written("$A_DBW", "[n] word of the PLC: the same"),
    main_run_written("$A_DBD", "[n] double word of the PLC: the same"),
    main_run_written("$A_DBR", "[n] REAL of the PLC: the same"),
    prepared("$A_YEAR", "2000: there is no clock of the day"),
    prepared("$A_MONTH", "1"),
    prepared("$A_DAY", "1"),
    prepared("$A_HOUR", "0"),
    prepared("$A_MINUTE", "0"),
    prepared("$A_SECOND", "0"),
    prepared("$A_MSECOND", "0"),
    written("$AN_SLTRACE", "1 marks the start, 2 the stop of a trace in the recording"),
    prepared("$MA_MAX_AX_VELO", "[axis] MD32000, mm/min or rev/min"),
    prepared("$MA_MAX_AX_ACCEL", "[axis] MD32300, m/s² or rev/s²"),
    prepared("$MA_MAX_AX_JERK", "[axis] MD32431, m/s³ or rev/s³"),
    prepared("$MA_PATH_TRANS_JERK_LIM", "[axis] MD32432, m/s³ or rev/s³"),
    prepared("$MA_POS_LIMIT_MINUS", "[axis] MD36100, mm or deg"),
    prepared("$MA_POS_LIMIT_PLUS", "[axis] MD36110, mm or deg"),
    prepared("$MA_IS_ROT_AX", "[axis] MD30300"),
    prepared("$MA_ROT_IS_MODULO", "[axis] MD30310"),
    prepared("$MA_POSCTRL_GAIN", "[axis] MD32200, (m/min)/mm"),
    prepared("$MA_VELO_FFW_WEIGHT", "[axis] MD32610"),
    prepared("$MA_AX_INERTIA", "[axis] MD32650, kg·m²"),
    prepared("$MA_STOP_LIMIT_COARSE", "[axis] MD36000, mm or deg"),
    prepared("$MA_STOP_LIMIT_FINE", "[axis] MD36010, mm or deg"),
    prepared("$MC_CURV_EFFECT_ON_PATH_ACCEL", "MD20602"),
    prepared("$MC_CURV_EFFECT_ON_PATH_JERK", "MD20603"),
    prepared("$MN_IPO_CYCLE_TIME", "MD10071, s"),
    prepared("$MN_AXCONF_MACHAX_NAME_TAB", "[n] name of machine axis n, from 0"),
    prepared("$MN_SCALING_SYSTEM_IS_METRIC", "TRUE"),
    prepared("$MC_CHAN_NAME", "CHAN1"),
    prepared("$MC_AXCONF_GEOAX_NAME_TAB", "[n] name of geometry axis n, from 0"),
    prepared("$MC_AXCONF_CHANAX_NAME_TAB", "[n] name of channel axis n, from 0"),
    prepared("$MC_MM_NUM_R_PARAM", "MD28050: number of R parameters"),
    prepared("$MC_MM_IPO_BUFFER_SIZE", "MD28060: blocks of the look-ahead"),
    prepared("$SC_SMOOTH_CONTUR_TOL", "SD42465, mm: the contour tolerance of the machine file"),
];
