//! Words that are known but not acted on: each is reported once a run, as a warning with line and consequence.
//!
//! In: nothing. Out: [`NOT_ACTED_ON`]. `docs/not-acted-on.md` lists exactly these words (a test compares). Does not hold words
//! without which the motion would be wrong in a way that a warning cannot make good: those are in `not_built`.

/// A word that is known but not acted on.
#[derive(Debug, PartialEq, Eq)]
pub struct NotActedOn {
    /// The word in capitals.
    pub word: &'static str,
    /// What that means for the result, as the end of a sentence.
    pub consequence: &'static str,
}

impl NotActedOn {
    /// The entry of a word, spelled as in the table.
    pub fn find(word: &str) -> Option<&'static Self> {
        NOT_ACTED_ON.iter().find(|entry| entry.word == word)
    }
}

const fn entry(word: &'static str, consequence: &'static str) -> NotActedOn {
    NotActedOn { word, consequence }
}

/// All of them, grouped as in the documentation.
pub static NOT_ACTED_ON: &[NotActedOn] = &[
    entry(
        "CYCLE800",
        "the tool or table is not swivelled; programs that call it with angles need the swivelled positions",
    ),
    entry("CYCLE81", "the drilling motion of the cycle is not made"),
    entry("CYCLE82", "the drilling motion of the cycle is not made"),
    entry("CYCLE83", "the drilling motion of the cycle is not made"),
    entry("CYCLE830", "the drilling motion of the cycle is not made"),
    entry("CYCLE84", "the drilling motion of the cycle is not made"),
    entry("CYCLE840", "the drilling motion of the cycle is not made"),
    entry("CYCLE85", "the drilling motion of the cycle is not made"),
    entry("CYCLE86", "the drilling motion of the cycle is not made"),
    entry("CYCLE87", "the drilling motion of the cycle is not made"),
    entry("CYCLE88", "the drilling motion of the cycle is not made"),
    entry("CYCLE89", "the drilling motion of the cycle is not made"),
    entry("CYCLE801", "the drilling motion of the cycle is not made"),
    entry("CYCLE802", "the drilling motion of the cycle is not made"),
    entry("CYCLE78", "the drilling motion of the cycle is not made"),
    entry("HOLES1", "the drilling motion of the cycle is not made"),
    entry("HOLES2", "the drilling motion of the cycle is not made"),
    entry("CYCLE60", "the milling motion of the cycle is not made"),
    entry("CYCLE61", "the milling motion of the cycle is not made"),
    entry("CYCLE62", "the milling motion of the cycle is not made"),
    entry("CYCLE63", "the milling motion of the cycle is not made"),
    entry("CYCLE64", "the milling motion of the cycle is not made"),
    entry("CYCLE70", "the milling motion of the cycle is not made"),
    entry("CYCLE71", "the milling motion of the cycle is not made"),
    entry("CYCLE72", "the milling motion of the cycle is not made"),
    entry("CYCLE73", "the milling motion of the cycle is not made"),
    entry("CYCLE74", "the milling motion of the cycle is not made"),
    entry("CYCLE75", "the milling motion of the cycle is not made"),
    entry("CYCLE76", "the milling motion of the cycle is not made"),
    entry("CYCLE77", "the milling motion of the cycle is not made"),
    entry("CYCLE79", "the milling motion of the cycle is not made"),
    entry("CYCLE90", "the milling motion of the cycle is not made"),
    entry("CYCLE899", "the milling motion of the cycle is not made"),
    entry("LONGHOLE", "the milling motion of the cycle is not made"),
    entry("POCKET1", "the milling motion of the cycle is not made"),
    entry("POCKET2", "the milling motion of the cycle is not made"),
    entry("POCKET3", "the milling motion of the cycle is not made"),
    entry("POCKET4", "the milling motion of the cycle is not made"),
    entry("SLOT1", "the milling motion of the cycle is not made"),
    entry("SLOT2", "the milling motion of the cycle is not made"),
    entry("CYCLE92", "the turning motion of the cycle is not made"),
    entry("CYCLE93", "the turning motion of the cycle is not made"),
    entry("CYCLE94", "the turning motion of the cycle is not made"),
    entry("CYCLE95", "the turning motion of the cycle is not made"),
    entry("CYCLE96", "the turning motion of the cycle is not made"),
    entry("CYCLE97", "the turning motion of the cycle is not made"),
    entry("CYCLE98", "the turning motion of the cycle is not made"),
    entry("CYCLE99", "the turning motion of the cycle is not made"),
    entry("CYCLE930", "the turning motion of the cycle is not made"),
    entry("CYCLE940", "the turning motion of the cycle is not made"),
    entry("CYCLE950", "the turning motion of the cycle is not made"),
    entry("CYCLE951", "the turning motion of the cycle is not made"),
    entry("CYCLE952", "the turning motion of the cycle is not made"),
    entry("CYCLE971", "the measuring motion of the cycle is not made, and its results are not set"),
    entry("CYCLE973", "the measuring motion of the cycle is not made, and its results are not set"),
    entry("CYCLE974", "the measuring motion of the cycle is not made, and its results are not set"),
    entry("CYCLE976", "the measuring motion of the cycle is not made, and its results are not set"),
    entry("CYCLE977", "the measuring motion of the cycle is not made, and its results are not set"),
    entry("CYCLE978", "the measuring motion of the cycle is not made, and its results are not set"),
    entry("CYCLE979", "the measuring motion of the cycle is not made, and its results are not set"),
    entry("CYCLE982", "the measuring motion of the cycle is not made, and its results are not set"),
    entry("CYCLE994", "the measuring motion of the cycle is not made, and its results are not set"),
    entry("CYCLE995", "the measuring motion of the cycle is not made, and its results are not set"),
    entry("CYCLE996", "the measuring motion of the cycle is not made, and its results are not set"),
    entry("CYCLE997", "the measuring motion of the cycle is not made, and its results are not set"),
    entry("CYCLE998", "the measuring motion of the cycle is not made, and its results are not set"),
    entry("CYCLE9960", "the measuring motion of the cycle is not made, and its results are not set"),
    entry("CYCLE150", "the measuring motion of the cycle is not made, and its results are not set"),
    entry("G41", "the path is that of the programmed contour, without the tool radius"),
    entry("G42", "the path is that of the programmed contour, without the tool radius"),
    entry("G62", "the feed is not lowered at inside corners"),
    entry("G621", "the feed is not lowered at corners"),
    entry("ORISON", "the orientation is not smoothed"),
    entry("I/J/K", "I, J or K of the axis across the plane has no effect on a circle"),
    entry("CPRECON", "the path velocity is not lowered for contour accuracy"),
    entry("STARTFIFO", "the look-ahead is filled as it always is"),
    entry("STOPFIFO", "the look-ahead is filled as it always is"),
    entry("FIFOCTRL", "the look-ahead is filled as it always is"),
    entry("NEWCONF", "machine data stay those of the machine file"),
    entry("TCARR", "no tool carrier is set"),
    entry("LIFTFAST", "there is no rapid lift from the contour"),
    entry("LFON", "there is no rapid lift from the contour"),
    entry("LFOF", "there is no rapid lift from the contour"),
    entry("WAITM", "there is one channel: nothing is waited for and no axis changes hands"),
    entry("WAITMC", "there is one channel: nothing is waited for and no axis changes hands"),
    entry("WAITE", "there is one channel: nothing is waited for and no axis changes hands"),
    entry("SETM", "there is one channel: nothing is waited for and no axis changes hands"),
    entry("CLEARM", "there is one channel: nothing is waited for and no axis changes hands"),
    entry("INIT", "there is one channel: nothing is waited for and no axis changes hands"),
    entry("START", "there is one channel: nothing is waited for and no axis changes hands"),
    entry("GET", "there is one channel: nothing is waited for and no axis changes hands"),
    entry("GETD", "there is one channel: nothing is waited for and no axis changes hands"),
    entry("RELEASE", "there is one channel: nothing is waited for and no axis changes hands"),
    entry("ID", "a synchronised action on anything but $AC_OVR is not executed"),
    entry("IDS", "a synchronised action on anything but $AC_OVR is not executed"),
    entry("WHEN", "a synchronised action on anything but $AC_OVR is not executed"),
    entry("WHENEVER", "a synchronised action on anything but $AC_OVR is not executed"),
    entry("EVERY", "a synchronised action on anything but $AC_OVR is not executed"),
    entry("FROM", "a synchronised action on anything but $AC_OVR is not executed"),
    entry("DO", "a synchronised action on anything but $AC_OVR is not executed"),
    entry("CANCEL", "synchronised actions are cancelled by their numbers only"),
    entry("$A_", "there is no PLC: inputs and PLC data are what the program wrote, else 0"),
    entry("$TC_", "tool data other than those of edges ($TC_DP1 to 25) and names ($TC_TP2) are not kept"),
];
