//! Message types of the recording: from `src/recorder/proto/*.proto` to Rust types and to the descriptors that travel in every
//! file. In pure Rust (protox): no `protoc` is needed. Everything goes to `OUT_DIR`.

use std::error::Error;
use std::path::{Path, PathBuf};
use std::{env, fs};

/// Folder that the imports of the .proto files count from.
const PROTO_FOLDER: &str = "src/recorder/proto";

/// One file for each schema of a recording, and the name of its descriptor set in `OUT_DIR`.
const SCHEMA_FILES: [(&str, &str); 7] = [
    ("sollwert/axis.proto", "axis.fds"),
    ("sollwert/path.proto", "path.fds"),
    ("sollwert/event.proto", "event.fds"),
    ("sollwert/spindle.proto", "spindle.fds"),
    ("sollwert/sample.proto", "sample.fds"),
    ("sollwert/programmed.proto", "programmed.fds"),
    ("foxglove/PoseInFrame.proto", "pose_in_frame.fds"),
];

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed={PROTO_FOLDER}");
    println!("cargo::rerun-if-changed=build.rs");
    let out_folder = PathBuf::from(env::var_os("OUT_DIR").ok_or("cargo sets OUT_DIR")?);
    for (proto, descriptors) in SCHEMA_FILES {
        fs::write(out_folder.join(descriptors), descriptor_set(Path::new(proto))?)?;
    }
    generate_types(&out_folder)
}

/// A file and all that it imports, without comments: what a reader needs to decode its messages.
fn descriptor_set(proto: &Path) -> Result<Vec<u8>, Box<dyn Error>> {
    let mut compiler = protox::Compiler::new([PROTO_FOLDER])?;
    compiler.include_imports(true).include_source_info(false).open_file(Path::new(PROTO_FOLDER).join(proto))?;
    Ok(compiler.encode_file_descriptor_set())
}

/// The Rust types, with the comments of the .proto files as their documentation.
fn generate_types(out_folder: &Path) -> Result<(), Box<dyn Error>> {
    let mut compiler = protox::Compiler::new([PROTO_FOLDER])?;
    compiler.include_imports(true).include_source_info(true);
    for (proto, _) in SCHEMA_FILES {
        compiler.open_file(Path::new(PROTO_FOLDER).join(proto))?;
    }
    prost_build::Config::new()
        .out_dir(out_folder)
        .compile_well_known_types()
        .include_file("messages.rs")
        .compile_fds(compiler.file_descriptor_set())?;
    Ok(())
}
