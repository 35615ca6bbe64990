//! Evidence, proposals and tags.

use super::problem::Findings;
use crate::store::error::Fault;
use crate::version::{Digest, Observation, is_tag_name, read_proposal_bytes};
use rusqlite::{Connection, Row};

/// Observations are what their digest and their version say, and those that confirm them are there.
pub(super) fn observations(connection: &Connection, findings: &mut Findings) -> Result<(), Fault> {
    const ROWS: &str = "SELECT o.id, o.version, o.capture, o.labels, o.decision, o.body, o.digest, v.evidence
        FROM observation AS o LEFT JOIN version AS v ON v.version = o.version ORDER BY o.id";
    const MISSING: &str = "SELECT v.version FROM version AS v LEFT JOIN observation AS o ON o.version = v.version
        WHERE v.evidence IS NOT NULL AND o.id IS NULL ORDER BY v.version";
    const NAMED: &str = "SELECT 1 FROM observation WHERE digest = ?1 ORDER BY id";
    let mut statement = connection.prepare(ROWS)?;
    let mut rows = statement.query([])?;
    while let Some(row) = rows.next()? {
        let place = format!("observation {}", row.get::<_, i64>("id")?);
        let (body, digest): (String, [u8; 32]) = (row.get("body")?, row.get("digest")?);
        let found = Digest::of(body.as_bytes());
        if found != Digest(digest) {
            findings.add(&place, format!("has digest {}, its text has {found}", Digest(digest)));
        }
        let (version, evidence): (Option<i64>, Option<[u8; 32]>) = (row.get("version")?, row.get("evidence")?);
        if let Some(version) = version.filter(|_| evidence != Some(digest)) {
            findings.add(&place, format!("is not the evidence that version {version} was hashed with"));
        }
        match Observation::from_json(&body) {
            Ok(observation) => {
                if !agrees(row, &observation, &body)? {
                    findings.add(&place, "capture, labels or decision differ from the text");
                }
                for digest in observation.confirmations {
                    if !connection.prepare_cached(NAMED)?.exists([digest.0])? {
                        findings.add(&place, format!("is confirmed by observation {digest}, which is not there"));
                    }
                }
            }
            Err(detail) => findings.add(&place, detail),
        }
    }
    let mut statement = connection.prepare(MISSING)?;
    let mut rows = statement.query([])?;
    while let Some(row) = rows.next()? {
        findings.add(format!("version {}", row.get::<_, i64>(0)?), "its observation is missing");
    }
    Ok(())
}

/// Whether the columns made from `observation`, whose text is `body`, say the same.
fn agrees(row: &Row, observation: &Observation, body: &str) -> Result<bool, Fault> {
    let (capture, decision): ([u8; 32], String) = (row.get("capture")?, row.get("decision")?);
    let labels = row.get::<_, Option<[u8; 32]>>("labels")?.map(|digest| Digest(digest).to_string());
    let file: serde_json::Value = serde_json::from_str(body).unwrap_or_default();
    Ok(observation.capture.0 == capture
        && observation.decision.name() == decision
        && file["labels"].as_str() == labels.as_deref())
}

/// The operations of proposals can be read.
pub(super) fn proposals(connection: &Connection, findings: &mut Findings) -> Result<(), Fault> {
    let mut statement = connection.prepare("SELECT id, operations FROM proposal ORDER BY id")?;
    let mut rows = statement.query([])?;
    while let Some(row) = rows.next()? {
        let operations = row.get_ref(1)?.as_blob().map_err(rusqlite::Error::from)?;
        if let Err(error) = read_proposal_bytes(operations) {
            findings.add(format!("proposal {}", row.get::<_, i64>(0)?), format!("operations: {error}"));
        }
    }
    Ok(())
}

/// Tags have names that can be asked for.
pub(super) fn tags(connection: &Connection, findings: &mut Findings) -> Result<(), Fault> {
    let mut statement = connection.prepare("SELECT name FROM tag ORDER BY name")?;
    let mut rows = statement.query([])?;
    while let Some(row) = rows.next()? {
        let name: String = row.get(0)?;
        if !is_tag_name(&name) {
            findings.add(format!("tag {name:?}"), "is not a name that a revision can have");
        }
    }
    Ok(())
}
