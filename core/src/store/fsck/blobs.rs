//! Geometry and label images: under their digest, and named by somebody.

use super::problem::Findings;
use crate::store::blobs::{Blobs, GEOMETRY, LABEL_IMAGES};
use crate::store::error::Fault;
use rusqlite::Connection;

/// Geometry is what its digest says.
pub(super) fn geometry(connection: &Connection, findings: &mut Findings) -> Result<(), Fault> {
    misplaced(connection, &GEOMETRY, findings)
}

/// Label images are what their digest says.
pub(super) fn label_images(connection: &Connection, findings: &mut Findings) -> Result<(), Fault> {
    misplaced(connection, &LABEL_IMAGES, findings)
}

/// Some object uses every geometry.
pub(super) fn unused_geometry(connection: &Connection, findings: &mut Findings) -> Result<(), Fault> {
    unused(connection, &GEOMETRY, findings)
}

/// Some observation names every label image.
pub(super) fn unused_label_images(connection: &Connection, findings: &mut Findings) -> Result<(), Fault> {
    unused(connection, &LABEL_IMAGES, findings)
}

fn misplaced(connection: &Connection, blobs: &Blobs, findings: &mut Findings) -> Result<(), Fault> {
    for found in blobs.misplaced(connection)? {
        findings.add(format!("{} {}", blobs.name, found.under), format!("its bytes have digest {}", found.own));
    }
    Ok(())
}

fn unused(connection: &Connection, blobs: &Blobs, findings: &mut Findings) -> Result<(), Fault> {
    for (_, digest) in blobs.orphans(connection)? {
        findings.add(format!("{} {digest}", blobs.name), blobs.unused);
    }
    Ok(())
}
