//! Rows -> Parquet.
//!
//! In: heads and rows. Out: the columns of the CSV: `time_s`, one column of doubles a signal, words as strings; null where the CSV is
//! empty. Not packed. Memory: one group of rows.

use super::export::{ColumnNames, Written, output_fault};
use super::sink::{Head, Layout, Sink};
use super::wire::TraceEvent;
use crate::base::Diagnostic;
use parquet::basic::{ConvertedType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;
use std::io::Write;
use std::sync::Arc;

/// Rows of a group.
const GROUP_ROWS: usize = 32 * 1024;

/// Writes a table.
pub(super) struct ParquetTable<W: Write + Send> {
    /// Until `begin` tells the columns.
    output: Option<W>,
    writer: Option<SerializedFileWriter<W>>,
    names: ColumnNames,
    times_s: Vec<f64>,
    columns: Vec<Column>,
    written: Written,
}

struct Column {
    held: bool,
    words: Option<Vec<ByteArray>>,
    now: f64,
    values: Vec<f64>,
}

impl<W: Write + Send> ParquetTable<W> {
    pub(super) fn new(output: W, names: ColumnNames) -> Self {
        Self {
            output: Some(output),
            writer: None,
            names,
            times_s: Vec::new(),
            columns: Vec::new(),
            written: Written::default(),
        }
    }

    /// Writes the last group and the footer.
    pub(super) fn finish(mut self) -> Result<(W, Written), Diagnostic> {
        self.write_group()?;
        let Some(writer) = self.writer else {
            return Err(Diagnostic::error("T0003", "there is nothing to export"));
        };
        let output = writer.into_inner().map_err(|error| fault(&error))?;
        Ok((output, self.written))
    }

    fn write_group(&mut self) -> Result<(), Diagnostic> {
        let Some(writer) = self.writer.as_mut().filter(|_| !self.times_s.is_empty()) else { return Ok(()) };
        write_group(writer, &self.times_s, &self.columns).map_err(|error| fault(&error))?;
        self.times_s.clear();
        self.columns.iter_mut().for_each(|column| column.values.clear());
        Ok(())
    }
}

fn write_group<W: Write + Send>(
    writer: &mut SerializedFileWriter<W>,
    times_s: &[f64],
    columns: &[Column],
) -> Result<(), ParquetError> {
    let mut group = writer.next_row_group()?;
    if let Some(mut column) = group.next_column()? {
        column.typed::<DoubleType>().write_batch(times_s, None, None)?;
        column.close()?;
    }
    for data in columns {
        let Some(mut column) = group.next_column()? else { break };
        let levels: Vec<i16> = data.values.iter().map(|value| i16::from(!value.is_nan())).collect();
        let there = data.values.iter().filter(|value| !value.is_nan());
        match &data.words {
            None => {
                let values: Vec<f64> = there.copied().collect();
                column.typed::<DoubleType>().write_batch(&values, Some(&levels), None)?;
            }
            Some(words) => {
                let word = |value: &f64| words.get(*value as usize).cloned().unwrap_or_default();
                let values: Vec<ByteArray> = there.map(word).collect();
                column.typed::<ByteArrayType>().write_batch(&values, Some(&levels), None)?;
            }
        }
        column.close()?;
    }
    group.close()?;
    Ok(())
}

fn schema(names: Vec<String>, heads: &[Head]) -> Result<Type, ParquetError> {
    let time =
        Type::primitive_type_builder("time_s", Physical::DOUBLE).with_repetition(Repetition::REQUIRED).build()?;
    let mut fields = vec![Arc::new(time)];
    for (name, head) in names.iter().zip(heads) {
        let builder = if head.words {
            Type::primitive_type_builder(name, Physical::BYTE_ARRAY).with_converted_type(ConvertedType::UTF8)
        } else {
            Type::primitive_type_builder(name, Physical::DOUBLE)
        };
        fields.push(Arc::new(builder.with_repetition(Repetition::OPTIONAL).build()?));
    }
    Type::group_type_builder("trace").with_fields(fields).build()
}

fn fault(error: &ParquetError) -> Diagnostic {
    output_fault(&std::io::Error::other(error.to_string()))
}

impl<W: Write + Send> Sink for ParquetTable<W> {
    fn begin(&mut self, heads: &[Head]) -> Result<(), Diagnostic> {
        let schema = schema(self.names.of(heads), heads).map_err(|error| fault(&error))?;
        let created_by = concat!("sollwert ", env!("CARGO_PKG_VERSION")).to_owned();
        let properties = WriterProperties::builder().set_created_by(created_by).build();
        if let Some(output) = self.output.take() {
            let writer = SerializedFileWriter::new(output, Arc::new(schema), Arc::new(properties));
            self.writer = Some(writer.map_err(|error| fault(&error))?);
        }
        let column = |head: &Head| Column {
            held: head.layout == Layout::Held,
            words: head.words.then(Vec::new),
            now: f64::NAN,
            values: Vec::with_capacity(GROUP_ROWS),
        };
        self.columns = heads.iter().map(column).collect();
        self.written.columns = heads.len() + 1;
        Ok(())
    }

    fn word(&mut self, signal: usize, word: &str) {
        if let Some(words) = self.columns.get_mut(signal).and_then(|column| column.words.as_mut()) {
            words.push(ByteArray::from(word));
        }
    }

    fn row(&mut self, time_s: f64, cells: &[(usize, f64)]) -> Result<(), Diagnostic> {
        for column in self.columns.iter_mut().filter(|column| !column.held) {
            column.now = f64::NAN;
        }
        for (place, value) in cells {
            if let Some(column) = self.columns.get_mut(*place) {
                column.now = *value;
            }
        }
        self.times_s.push(time_s);
        for column in &mut self.columns {
            column.values.push(column.now);
        }
        self.written.rows += 1;
        if self.times_s.len() >= GROUP_ROWS { self.write_group() } else { Ok(()) }
    }

    fn event(&mut self, _: TraceEvent) -> Result<(), Diagnostic> {
        // A table has no place for events.
        Ok(())
    }
}
