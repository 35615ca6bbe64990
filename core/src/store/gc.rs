//! Forgetting old versions on request, and what nobody uses any more.

use super::error::{Fault, StoreError};
use super::feature_rows::last_fid;
use super::forgotten::all_remains;
use super::fsck;
use super::index;
use super::kept_states::write_kept_states;
use super::map_file::{MapFile, WriteFault};
use super::operations::{deltas_of, operations_digest};
use super::rows::head;
use crate::version::{Fid, VersionId};
use jiff::Timestamp;
use rusqlite::{Connection, named_params};
use std::collections::{BTreeMap, BTreeSet};

/// What gc removes, or would remove.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Forgetting {
    /// Versions whose state nobody can ask for afterwards.
    pub versions: Vec<VersionId>,
    /// Versions whose state is kept, with those that were before.
    pub kept: Vec<VersionId>,
    /// States of features that no kept version has.
    pub states: u64,
    /// Meshes that no kept state uses.
    pub geometries: u64,
    /// Label images behind nothing that is kept.
    pub label_images: u64,
    /// Bytes of all these, before SQLite packs them.
    pub bytes: u64,
}

impl Forgetting {
    /// Whether there is nothing to remove.
    pub fn is_empty(&self) -> bool {
        self.versions.is_empty() && (self.states, self.geometries, self.label_images) == (0, 0, 0)
    }
}

impl MapFile {
    /// What [`MapFile::gc`] would remove.
    pub fn gc_plan(&self, before: Option<VersionId>) -> Result<Forgetting, StoreError> {
        self.read(|connection| Ok(plan(connection, before)?.forgetting()))
    }

    /// Forgets the versions before `before`, but for version 0, tagged ones and head, and removes what nobody uses any
    /// more: all of it or nothing. Without `before` no version is forgotten. Of a damaged map nothing is: what seems to be
    /// used by nobody may be what the damaged part asks for, and what proves the rest goes with what is forgotten.
    pub fn gc(&self, before: Option<VersionId>, now: Timestamp) -> Result<Forgetting, StoreError> {
        let planned = self.gc_plan(before)?;
        if planned.is_empty() {
            return Ok(planned);
        }
        self.write(|connection| -> Result<Forgetting, WriteFault<StoreError>> {
            let plan = plan(connection, before)?;
            if let Some(first) = fsck::damage(connection, &self.path)?.first() {
                return Err(Fault::Damage(format!("{first}; nothing was forgotten or removed")).into());
            }
            forget(connection, &plan, now)?;
            remove(connection, &plan)?;
            write_kept_states(connection)?;
            Ok(plan.forgetting())
        })
    }

    /// Gives the space of what was removed back to the disk: SQLite writes the whole file anew.
    pub fn compact(&self) -> Result<(), StoreError> {
        let _turn = self.take_turn()?;
        self.outside(|connection| {
            Ok(connection.execute_batch(
                "PRAGMA cache_spill = 1; VACUUM; PRAGMA cache_spill = 0; PRAGMA wal_checkpoint(TRUNCATE)",
            )?)
        })
    }
}

/// A state of a feature that no kept version has.
pub(super) struct Unreachable {
    id: i64,
    pub(super) fid: Fid,
    pub(super) from: VersionId,
    bytes: u64,
}

struct Plan {
    forgotten: Vec<VersionId>,
    kept: BTreeSet<VersionId>,
    states: Vec<Unreachable>,
    geometries: Vec<([u8; 32], u64)>,
    label_images: Vec<([u8; 32], u64)>,
}

impl Plan {
    fn forgetting(&self) -> Forgetting {
        let blobs = self.geometries.iter().chain(&self.label_images).map(|(_, bytes)| bytes).sum::<u64>();
        Forgetting {
            versions: self.forgotten.clone(),
            kept: self.kept.iter().copied().collect(),
            states: self.states.len() as u64,
            geometries: self.geometries.len() as u64,
            label_images: self.label_images.len() as u64,
            bytes: blobs + self.states.iter().map(|state| state.bytes).sum::<u64>(),
        }
    }
}

fn plan(connection: &Connection, before: Option<VersionId>) -> Result<Plan, Fault> {
    let head = head(connection)?.version;
    let limit = before.unwrap_or(VersionId(0));
    if limit > head {
        return Err(StoreError::NoSuchVersion { version: limit, head }.into());
    }
    let mut kept = kept(connection)?;
    let tagged = tagged(connection)?;
    let is_spared = |version: &VersionId| version.0 == 0 || *version >= limit || tagged.contains(version);
    let forgotten: Vec<VersionId> = kept.iter().copied().filter(|version| !is_spared(version)).collect();
    kept.retain(is_spared);
    let states = unreachable_among(connection, &kept)?;
    let dead: BTreeSet<i64> = states.iter().map(|state| state.id).collect();
    Ok(Plan {
        geometries: unused_geometries(connection, &dead)?,
        label_images: unused_label_images(connection, &kept, &dead)?,
        forgotten,
        kept,
        states,
    })
}

/// Every version whose state is whole.
fn kept(connection: &Connection) -> Result<BTreeSet<VersionId>, Fault> {
    let remains = all_remains(connection)?;
    let is_kept = |version: &VersionId| remains.get(version).is_none_or(|remains| remains.has_state);
    let mut statement = connection.prepare("SELECT version FROM version ORDER BY version")?;
    let versions = statement.query_map([], |row| Ok(VersionId(row.get::<_, i64>(0)?.unsigned_abs())))?;
    let versions = versions.collect::<Result<Vec<_>, _>>()?;
    Ok(versions.into_iter().filter(is_kept).collect())
}

fn tagged(connection: &Connection) -> Result<BTreeSet<VersionId>, Fault> {
    let mut statement = connection.prepare("SELECT DISTINCT version FROM tag ORDER BY version")?;
    let tagged = statement.query_map([], |row| Ok(VersionId(row.get::<_, i64>(0)?.unsigned_abs())))?;
    Ok(tagged.collect::<Result<_, _>>()?)
}

/// States that no version has any more.
pub(super) fn unreachable(connection: &Connection) -> Result<Vec<Unreachable>, Fault> {
    unreachable_among(connection, &kept(connection)?)
}

fn unreachable_among(connection: &Connection, kept: &BTreeSet<VersionId>) -> Result<Vec<Unreachable>, Fault> {
    const SQL: &str = "SELECT id, fid, from_version, to_version, length(state) FROM feature_version
        WHERE to_version IS NOT NULL ORDER BY id";
    let mut statement = connection.prepare(SQL)?;
    let mut rows = statement.query([])?;
    let mut found = Vec::new();
    while let Some(row) = rows.next()? {
        let [from, to] = [row.get::<_, i64>(2)?, row.get::<_, i64>(3)?].map(|number| VersionId(number.unsigned_abs()));
        // An empty or reversed span is damage, not something to forget.
        if from < to && kept.range(from..to).next().is_none() {
            let (id, fid) = (row.get(0)?, Fid(row.get::<_, i64>(1)?.unsigned_abs()));
            found.push(Unreachable { id, fid, from, bytes: row.get::<_, i64>(4)?.unsigned_abs() });
        }
    }
    Ok(found)
}

/// Geometry that only rows in `dead` use, or none.
fn unused_geometries(connection: &Connection, dead: &BTreeSet<i64>) -> Result<Vec<([u8; 32], u64)>, Fault> {
    const USED: &str = "SELECT id, geometry FROM feature_version WHERE geometry IS NOT NULL ORDER BY id";
    let mut statement = connection.prepare(USED)?;
    let mut rows = statement.query([])?;
    let mut used: BTreeSet<[u8; 32]> = BTreeSet::new();
    while let Some(row) = rows.next()? {
        if !dead.contains(&row.get(0)?) {
            used.insert(row.get(1)?);
        }
    }
    blobs_except(connection, "SELECT digest, length(bytes) FROM geometry ORDER BY digest", &used)
}

/// Label images that are evidence of nothing in `kept`: neither of an attempt without a version, nor of a kept version, nor
/// of one whose states live on.
fn unused_label_images(
    connection: &Connection,
    kept: &BTreeSet<VersionId>,
    dead: &BTreeSet<i64>,
) -> Result<Vec<([u8; 32], u64)>, Fault> {
    const BEHIND: &str = "SELECT labels, version FROM observation WHERE labels IS NOT NULL ORDER BY id";
    const BEGAN: &str = "SELECT id FROM feature_version WHERE from_version = :version ORDER BY id";
    let mut began = connection.prepare(BEGAN)?;
    let mut lives_on = |version: i64| -> Result<bool, Fault> {
        let mut rows = began.query(named_params! {":version": version})?;
        while let Some(row) = rows.next()? {
            if !dead.contains(&row.get(0)?) {
                return Ok(true);
            }
        }
        Ok(false)
    };
    let mut statement = connection.prepare(BEHIND)?;
    let mut rows = statement.query([])?;
    let mut used: BTreeSet<[u8; 32]> = BTreeSet::new();
    while let Some(row) = rows.next()? {
        let is_used = match row.get::<_, Option<i64>>(1)? {
            None => true,
            Some(version) => kept.contains(&VersionId(version.unsigned_abs())) || lives_on(version)?,
        };
        if is_used {
            used.insert(row.get(0)?);
        }
    }
    blobs_except(connection, "SELECT digest, length(bytes) FROM label_image ORDER BY digest", &used)
}

fn blobs_except(connection: &Connection, sql: &str, used: &BTreeSet<[u8; 32]>) -> Result<Vec<([u8; 32], u64)>, Fault> {
    let mut statement = connection.prepare(sql)?;
    let blobs = statement.query_map([], |row| Ok((row.get(0)?, row.get::<_, i64>(1)?.unsigned_abs())))?;
    let mut unused = blobs.collect::<Result<Vec<([u8; 32], u64)>, _>>()?;
    unused.retain(|(digest, _)| !used.contains(digest));
    Ok(unused)
}

/// Keeps the digest of what each version did whose operations cannot be worked out any more: the forgotten ones and the
/// first after them.
fn forget(connection: &Connection, plan: &Plan, now: Timestamp) -> Result<(), Fault> {
    const SQL: &str = "INSERT INTO forgotten (version, has_state, operations, last_fid, forgotten_at)
        VALUES (:version, :has_state, :operations, :last_fid, :now) ON CONFLICT (version) DO UPDATE SET has_state = 0";
    let last_fid = last_fid(connection)?;
    let cut_off = plan.forgotten.iter().map(|version| VersionId(version.0 + 1)).filter(|next| plan.kept.contains(next));
    let remembered = all_remains(connection)?;
    let touched: BTreeMap<VersionId, bool> =
        plan.forgotten.iter().map(|version| (*version, false)).chain(cut_off.map(|version| (version, true))).collect();
    for (version, has_state) in touched {
        let operations = match remembered.get(&version) {
            Some(_) if has_state => continue,
            Some(remains) => remains.operations,
            None => operations_digest(connection, version, &deltas_of(connection, version)?)?,
        };
        connection.prepare_cached(SQL)?.execute(named_params! {
            ":version": version.0 as i64, ":has_state": has_state, ":operations": operations.0,
            ":last_fid": last_fid.0 as i64, ":now": now.as_microsecond(),
        })?;
    }
    Ok(())
}

fn remove(connection: &Connection, plan: &Plan) -> Result<(), Fault> {
    const DELETE: &str = "DELETE FROM feature_version WHERE id = :id";
    index::remove(connection, &plan.states.iter().map(|state| state.id).collect())?;
    for state in &plan.states {
        connection.prepare_cached(DELETE)?.execute(named_params! {":id": state.id})?;
    }
    for (sql, blobs) in [
        ("DELETE FROM geometry WHERE digest = :digest", &plan.geometries),
        ("DELETE FROM label_image WHERE digest = :digest", &plan.label_images),
    ] {
        for (digest, _) in blobs {
            connection.prepare_cached(sql)?.execute(named_params! {":digest": digest})?;
        }
    }
    Ok(())
}
