//! Updates that wait for review: deltas against a base version that are not in the history yet.

use super::commit::{make_unseen_version, make_version};
use super::commit_error::CommitError;
use super::error::{Fault, StoreError};
use super::map_file::{MapFile, WriteFault};
use super::observations::{Evidence, digest_of, link};
use super::plan::{check_request, check_states};
use super::rows::{box_columns, classes_at, head, read_box, timestamp};
use super::seal;
use crate::version::{
    BoxMm, Delta, FeatureState, Observation, UpdateTransaction, VersionId, VersionKind, proposal_bytes,
    read_proposal_bytes,
};
use jiff::Timestamp;
use rusqlite::{Connection, OptionalExtension, Row, ToSql, named_params};

/// A proposed update.
#[derive(Clone, Debug, PartialEq)]
pub struct Proposal {
    /// Its number.
    pub id: u64,
    /// When it was proposed.
    pub proposed_at: Timestamp,
    /// What it would commit; its evidence is under `observation`.
    pub transaction: UpdateTransaction,
    /// Number of the observation behind it.
    pub observation: Option<u64>,
    /// What became of it.
    pub status: ProposalStatus,
    /// Who decided, when, and why.
    pub decision: Option<ProposalDecision>,
}

/// What became of a proposal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProposalStatus {
    /// Nobody decided.
    Open,
    /// It made this version.
    Accepted(VersionId),
    /// It made none.
    Rejected,
}

/// A reviewer's decision.
#[derive(Clone, Debug, PartialEq)]
pub struct ProposalDecision {
    /// When.
    pub at: Timestamp,
    /// Who.
    pub by: String,
    /// Why; may be empty.
    pub note: String,
}

const COLUMNS: &str = "id, base_version, kind, proposed_at, observed_at, author, message, idempotency_key,
    e0, e1, n0, n1, h0, h1, operations, observation, status, decided_at, decided_by, note, version";

impl MapFile {
    /// Keeps `transaction` for review and returns the number of the proposal; the same idempotency key again gives the
    /// proposal of the first time.
    pub fn propose(&self, transaction: &UpdateTransaction, now: Timestamp) -> Result<u64, CommitError> {
        let ids = self.keep(std::slice::from_ref(transaction), transaction.evidence.as_ref(), now)?;
        Ok(ids.first().copied().unwrap_or_default())
    }

    /// Keeps each of `transactions` for review, all on the same evidence, and returns the numbers of the proposals in
    /// their order.
    pub fn propose_each(
        &self,
        transactions: &[UpdateTransaction],
        evidence: &Observation,
        now: Timestamp,
    ) -> Result<Vec<u64>, CommitError> {
        self.keep(transactions, Some(evidence), now)
    }

    fn keep(
        &self,
        transactions: &[UpdateTransaction],
        evidence: Option<&Observation>,
        now: Timestamp,
    ) -> Result<Vec<u64>, CommitError> {
        let evidence = evidence.map(Evidence::of).transpose()?;
        self.write(|connection| -> Result<Vec<u64>, WriteFault<CommitError>> {
            let head = head(connection)?;
            let classes = classes_at(connection, head.version)?;
            let (mut ids, mut observation) = (Vec::with_capacity(transactions.len()), None);
            for transaction in transactions {
                if let Some(made) = proposed_before(connection, transaction)? {
                    ids.push(made);
                    continue;
                }
                check_request(transaction, head.version)?;
                check_is_descriptors(transaction)?;
                check_states(transaction, &classes)?;
                if let (Some(evidence), None) = (&evidence, observation) {
                    observation = Some(evidence.insert(connection, transaction.base, None, now)?);
                }
                ids.push(insert(connection, transaction, observation, now)?);
            }
            Ok(ids)
        })
    }

    /// Commits `transaction`, on which the open proposals `ids` agree, and closes them with its version.
    pub fn confirm(
        &self,
        ids: &[u64],
        transaction: &UpdateTransaction,
        note: &str,
        now: Timestamp,
    ) -> Result<VersionId, CommitError> {
        let evidence = transaction.evidence.as_ref().map(Evidence::of).transpose()?;
        let digest = evidence.as_ref().map(|evidence| evidence.digest);
        self.write(|connection| -> Result<VersionId, WriteFault<CommitError>> {
            for id in ids {
                open_one(connection, *id)?;
            }
            let record = make_unseen_version(connection, transaction, digest, now)?;
            if let Some(evidence) = evidence {
                evidence.insert(connection, transaction.base, Some(record.version), record.committed_at)?;
            }
            let decision = ProposalDecision::new(now, &transaction.author, note);
            for id in ids {
                decide(connection, *id, Some(record.version), &decision)?;
            }
            Ok(record.version)
        })
    }

    /// Every proposal, newest first.
    pub fn proposals(&self) -> Result<Vec<Proposal>, StoreError> {
        let sql = format!("SELECT {COLUMNS} FROM proposal ORDER BY id DESC");
        self.read(|connection| select(connection, &sql, &[]))
    }

    /// Those that nobody decided, oldest first.
    pub fn open_proposals(&self) -> Result<Vec<Proposal>, StoreError> {
        // The literal condition makes the partial index usable.
        let sql = format!("SELECT {COLUMNS} FROM proposal WHERE status = 'open' ORDER BY id");
        self.read(|connection| select(connection, &sql, &[]))
    }

    /// The proposal numbered `id`.
    pub fn proposal(&self, id: u64) -> Result<Proposal, StoreError> {
        self.read(|connection| one(connection, id))
    }

    /// Commits the proposal `id`: every `before` must still be live. What else changed in the region that was viewed
    /// is for the reviewer to judge.
    pub fn accept(&self, id: u64, by: &str, note: &str, now: Timestamp) -> Result<VersionId, CommitError> {
        self.write(|connection| -> Result<VersionId, WriteFault<CommitError>> {
            let proposal = open_one(connection, id)?;
            let mut transaction = proposal.transaction;
            let viewed_region = transaction.viewed_region.take();
            let evidence = proposal.observation.map(|id| digest_of(connection, id)).transpose()?;
            let record = make_version(connection, &transaction, (evidence, viewed_region.as_ref()), now)?;
            if let Some(observation) = proposal.observation {
                link(connection, observation, record.version)?;
            }
            decide(connection, id, Some(record.version), &ProposalDecision::new(now, by, note))?;
            Ok(record.version)
        })
    }

    /// Closes the proposal `id` without a version.
    pub fn reject(&self, id: u64, by: &str, note: &str, now: Timestamp) -> Result<(), StoreError> {
        self.write(|connection| -> Result<(), WriteFault<StoreError>> {
            open_one(connection, id)?;
            Ok(decide(connection, id, None, &ProposalDecision::new(now, by, note))?)
        })
    }
}

impl ProposalDecision {
    fn new(at: Timestamp, by: &str, note: &str) -> Self {
        Self { at, by: by.to_owned(), note: note.to_owned() }
    }
}

fn check_is_descriptors(transaction: &UpdateTransaction) -> Result<(), CommitError> {
    let sides = transaction.deltas.iter().flat_map(|delta| delta.before().into_iter().chain(delta.after()));
    let is_object = |state: &FeatureState| matches!(state, FeatureState::Object { .. });
    if transaction.additions.iter().chain(sides).any(is_object) {
        return Err(CommitError::NotProposable { found: "an object" });
    }
    match &transaction.classes {
        Some(_) => Err(CommitError::NotProposable { found: "a class table" }),
        None => Ok(()),
    }
}

/// The proposal that the same request made before; refuses the key of a proposal that is another.
fn proposed_before(
    connection: &Connection,
    transaction: &UpdateTransaction,
) -> Result<Option<u64>, WriteFault<CommitError>> {
    const SQL: &str = "SELECT id, operations FROM proposal WHERE idempotency_key = :key ORDER BY id LIMIT 1";
    let Some(key) = &transaction.idempotency_key else { return Ok(None) };
    let mut statement = connection.prepare_cached(SQL)?;
    let read = |row: &Row| Ok((row.get::<_, i64>(0)?.unsigned_abs(), row.get::<_, Vec<u8>>(1)?));
    let Some((id, operations)) = statement.query_row(named_params! {":key": key}, read).optional()? else {
        return Ok(None);
    };
    if operations != proposal_bytes(&transaction.deltas, &transaction.additions) {
        return Err(CommitError::OtherProposal { key: key.clone(), id }.into());
    }
    Ok(Some(id))
}

fn insert(
    connection: &Connection,
    transaction: &UpdateTransaction,
    observation: Option<u64>,
    now: Timestamp,
) -> Result<u64, Fault> {
    const SQL: &str = "INSERT INTO proposal (base_version, kind, proposed_at, observed_at, author, message,
            idempotency_key, e0, e1, n0, n1, h0, h1, operations, observation, status)
        VALUES (:base, :kind, :proposed_at, :observed_at, :author, :message,
            :key, :e0, :e1, :n0, :n1, :h0, :h1, :operations, :observation, 'open')";
    let [e0, e1, n0, n1, h0, h1] = box_columns(transaction.viewed_region.as_ref());
    connection.prepare_cached(SQL)?.execute(named_params! {
        ":base": transaction.base.0 as i64, ":kind": transaction.kind.name(), ":proposed_at": now.as_microsecond(),
        ":observed_at": transaction.observed_at.map(Timestamp::as_microsecond), ":author": transaction.author,
        ":message": transaction.message, ":key": transaction.idempotency_key,
        ":e0": e0, ":e1": e1, ":n0": n0, ":n1": n1, ":h0": h0, ":h1": h1,
        ":operations": proposal_bytes(&transaction.deltas, &transaction.additions),
        ":observation": observation.map(|id| id as i64),
    })?;
    let id = connection.last_insert_rowid();
    seal::PROPOSAL.seal(connection, &id)?;
    Ok(id.unsigned_abs())
}

fn one(connection: &Connection, id: u64) -> Result<Proposal, Fault> {
    let sql = format!("SELECT {COLUMNS} FROM proposal WHERE id = :id ORDER BY id");
    let found = select(connection, &sql, &[(":id", &i64::try_from(id).unwrap_or(i64::MAX))])?.pop();
    found.ok_or_else(|| StoreError::NoSuchProposal { id }.into())
}

fn open_one(connection: &Connection, id: u64) -> Result<Proposal, Fault> {
    let proposal = one(connection, id)?;
    let status = match proposal.status {
        ProposalStatus::Open => return Ok(proposal),
        ProposalStatus::Accepted(_) => "accepted",
        ProposalStatus::Rejected => "rejected",
    };
    Err(StoreError::ProposalDecided { id, status: status.to_owned() }.into())
}

fn decide(
    connection: &Connection,
    id: u64,
    version: Option<VersionId>,
    decision: &ProposalDecision,
) -> Result<(), Fault> {
    const SQL: &str = "UPDATE proposal SET status = :status, decided_at = :at, decided_by = :by, note = :note,
        version = :version WHERE id = :id AND status = 'open'";
    connection.prepare_cached(SQL)?.execute(named_params! {
        ":status": if version.is_some() { "accepted" } else { "rejected" }, ":at": decision.at.as_microsecond(),
        ":by": decision.by, ":note": decision.note, ":version": version.map(|version| version.0 as i64),
        ":id": id as i64,
    })?;
    seal::PROPOSAL.seal(connection, &(id as i64))
}

fn select(connection: &Connection, sql: &str, parameters: &[(&str, &dyn ToSql)]) -> Result<Vec<Proposal>, Fault> {
    let mut statement = connection.prepare_cached(sql)?;
    let mut rows = statement.query(parameters)?;
    let mut proposals = Vec::new();
    while let Some(row) = rows.next()? {
        proposals.push(read(row)?);
    }
    Ok(proposals)
}

fn read(row: &Row) -> Result<Proposal, Fault> {
    let number = |name| -> Result<Option<u64>, Fault> { Ok(row.get::<_, Option<i64>>(name)?.map(i64::unsigned_abs)) };
    let id = row.get::<_, i64>("id")?.unsigned_abs();
    let damage = |detail: String| Fault::Damage(format!("proposal {id}: {detail}"));
    let (status, version): (String, _) = (row.get("status")?, number("version")?.map(VersionId));
    let status = match (status.as_str(), version) {
        ("open", None) => ProposalStatus::Open,
        ("accepted", Some(version)) => ProposalStatus::Accepted(version),
        ("rejected", None) => ProposalStatus::Rejected,
        _ => return Err(damage(format!("status {status:?}"))),
    };
    let decision = match row.get::<_, Option<i64>>("decided_at")? {
        Some(at) => Some(ProposalDecision { at: timestamp(at)?, by: row.get("decided_by")?, note: row.get("note")? }),
        None => None,
    };
    Ok(Proposal {
        id,
        proposed_at: timestamp(row.get("proposed_at")?)?,
        transaction: read_transaction(row, &damage)?,
        observation: number("observation")?,
        status,
        decision,
    })
}

fn read_transaction(row: &Row, damage: &dyn Fn(String) -> Fault) -> Result<UpdateTransaction, Fault> {
    let base = VersionId(row.get::<_, i64>("base_version")?.unsigned_abs());
    let kind: String = row.get("kind")?;
    let kind = VersionKind::ALL.into_iter().find(|known| known.name() == kind);
    let kind = kind.ok_or_else(|| damage("a kind that is not known".to_owned()))?;
    let operations = row.get_ref("operations")?.as_blob().map_err(rusqlite::Error::from)?;
    let operations: (Vec<Delta>, Vec<FeatureState>) =
        read_proposal_bytes(operations).map_err(|error| damage(error.to_string()))?;
    let viewed_region: Option<BoxMm> = read_box(row)?;
    let mut transaction = UpdateTransaction::new(base, kind, row.get::<_, String>("author")?, String::new());
    transaction.message = row.get("message")?;
    transaction.observed_at = row.get::<_, Option<i64>>("observed_at")?.map(timestamp).transpose()?;
    transaction.idempotency_key = row.get("idempotency_key")?;
    (transaction.deltas, transaction.additions) = operations;
    transaction.viewed_region = viewed_region;
    Ok(transaction)
}
