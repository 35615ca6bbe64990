//! `resurvey proposals`.

use super::diff::Sides;
use crate::args::{ProposalAction, Proposals};
use crate::commands::evidence;
use crate::conflict::refused;
use crate::console::Console;
use crate::document;
use crate::failure::{CONFLICT, Failure, conflict};
use crate::plain::plain;
use comfy_table::{Table, presets};
use jiff::Timestamp;
use resurvey_core::store::{
    ConflictingChange, History, MapFile, Proposal, ProposalStatus, RecordedObservation, Snapshot,
};
use resurvey_core::update::in_the_way;
use resurvey_core::version::{BoxMm, Delta, FeatureState, Fid};
use resurvey_schema::{ClassTable, Descriptor};
use serde_json::{Value, json};

/// Lists, shows and decides proposals.
pub fn run(options: &Proposals, console: &mut Console<'_>) -> Result<u8, Failure> {
    refuse_what_is_not_used(options)?;
    let id = || {
        let expected = "expected the number of a proposal, as \"resurvey proposals MAP list\" prints it";
        options.id.ok_or_else(|| Failure::usage(expected))
    };
    match options.action {
        ProposalAction::List => list(options, console),
        ProposalAction::Show => show(&MapFile::open_read_only(&options.map)?, id()?, console),
        ProposalAction::Accept => accept(options, id()?, console),
        ProposalAction::Reject => {
            let id = id()?;
            MapFile::open(&options.map)?.reject(
                id,
                decider(options),
                options.note.as_deref().unwrap_or_default(),
                Timestamp::now(),
            )?;
            console.did(format_args!("proposal {id} was rejected"));
            if console.is_json() {
                console.document(&json!({ "id": id, "status": "rejected" }))?;
            } else {
                console.line(format_args!("proposal {id} is rejected"))?;
            }
            Ok(0)
        }
    }
}

/// Refuses what the action would pass over in silence.
fn refuse_what_is_not_used(options: &Proposals) -> Result<(), Failure> {
    let is_list = options.action == ProposalAction::List;
    let decides = matches!(options.action, ProposalAction::Accept | ProposalAction::Reject);
    let unused = [
        (is_list && options.id.is_some(), "a number belongs to show, accept and reject"),
        (!is_list && options.all, "--all belongs to list"),
        (!decides && options.by.is_some(), "--by belongs to accept and reject"),
        (!decides && options.note.is_some(), "--note belongs to accept and reject"),
    ];
    unused.into_iter().find(|(is_unused, _)| *is_unused).map_or(Ok(()), |(_, text)| Err(Failure::usage(text)))
}

fn decider(options: &Proposals) -> &str {
    options.by.as_deref().unwrap_or("resurvey")
}

fn list(options: &Proposals, console: &mut Console<'_>) -> Result<u8, Failure> {
    let map = MapFile::open_read_only(&options.map)?;
    let snapshot = map.snapshot(map.head()?)?;
    let mut proposals = map.proposals()?;
    proposals.retain(|proposal| options.all || proposal.status == ProposalStatus::Open);
    if console.is_json() {
        let entries = proposals.iter().map(|proposal| document(&map, proposal, snapshot.classes()));
        console.document(&json!({ "proposals": entries.collect::<Result<Vec<_>, _>>()? }))?;
        return Ok(0);
    }
    let mut table = Table::new();
    table.load_preset(presets::NOTHING).set_header(["id", "status", "proposed", "author", "change"]);
    for proposal in &proposals {
        let changes: Vec<String> = deltas(proposal).iter().map(|delta| change(delta, snapshot.classes())).collect();
        table.add_row([
            proposal.id.to_string(),
            status(proposal).to_owned(),
            proposal.proposed_at.to_string(),
            plain(&proposal.transaction.author).into_owned(),
            changes.join("; "),
        ]);
    }
    console.line(table.trim_fmt())?;
    Ok(0)
}

fn show(map: &MapFile, id: u64, console: &mut Console<'_>) -> Result<u8, Failure> {
    let proposal = map.proposal(id)?;
    let snapshot = map.snapshot(map.head()?)?;
    let classes = snapshot.classes();
    let observation = observation(map, &proposal)?;
    if console.is_json() {
        let mut document = document(map, &proposal, classes)?;
        let evidence = observation.as_ref().map(|seen| evidence::observation(map, seen, classes)).transpose()?;
        document["observation"] = json!(evidence);
        console.document(&document)?;
        return Ok(0);
    }
    let (author, message) = (plain(&proposal.transaction.author), plain(&proposal.transaction.message));
    console.line(format_args!("proposal {id}: {}, by {author}", status(&proposal)))?;
    console.line(format_args!("  message   {message}"))?;
    console.line(format_args!("  base      version {}", proposal.transaction.base))?;
    if let Some(decision) = &proposal.decision {
        let (by, note) = (plain(&decision.by), plain(&decision.note));
        console.line(format_args!("  decided   {} by {by}: {note}", decision.at))?;
    }
    let sides = Sides { before: classes, after: classes };
    for delta in deltas(&proposal) {
        sides.text(&delta, console)?;
    }
    match &observation {
        Some(seen) => evidence::print_observation(map, seen, classes, console)?,
        None => console.line("  evidence  none: not made from a capture")?,
    }
    Ok(0)
}

fn accept(options: &Proposals, id: u64, console: &mut Console<'_>) -> Result<u8, Failure> {
    let map = MapFile::open(&options.map)?;
    let accepted = map.together(|map| -> Result<_, Failure> {
        let proposal = map.proposal(id)?;
        if proposal.status == ProposalStatus::Open {
            refuse_what_is_there(map, &proposal)?;
        }
        let accepted = map.accept(id, decider(options), options.note.as_deref().unwrap_or_default(), Timestamp::now());
        accepted.map_err(|error| of_proposal(refused(error, map, &proposal.transaction.deltas), &proposal))
    });
    let version = accepted?;
    console.did(format_args!("proposal {id} was accepted as version {version}"));
    if console.is_json() {
        console.document(&json!({ "id": id, "status": "accepted", "version": version.0 }))?;
    } else {
        console.line(format_args!("proposal {id} is accepted as version {version}"))?;
    }
    Ok(0)
}

/// A conflict of the proposal, for machines too.
fn of_proposal(failure: Failure, proposal: &Proposal) -> Failure {
    failure.with("id", proposal.id).with("status", status(proposal))
}

/// Refuses to put on the map what another update put there since.
fn refuse_what_is_there(map: &MapFile, proposal: &Proposal) -> Result<(), Failure> {
    let head = map.head()?;
    let snapshot = map.snapshot(head)?;
    for state in &proposal.transaction.additions {
        let FeatureState::Descriptor(added) = state else { continue };
        if let Some(fid) = in_the_way(added, &descriptors_near(&snapshot, &state.bounds()?)?) {
            let next = format!("look at both with \"resurvey why\" and \"proposals show {}\"", proposal.id);
            let text = format!("feature {fid} is where proposal {} puts its own; {next}", proposal.id);
            let there = map.feature(head, Fid(fid))?;
            let found = document::state(&there.state, snapshot.classes())?;
            let change = ConflictingChange {
                fid: there.fid,
                changed_in: Some(there.from),
                found: Some(there.state),
                is_target: false,
            };
            let mut document = conflict(proposal.transaction.base, head, &[change], &[]);
            document["conflicts"][0]["found"] = found.into();
            let failure = Failure::new(CONFLICT, anyhow::anyhow!(text)).with_document(document);
            return Err(of_proposal(failure, proposal));
        }
    }
    Ok(())
}

fn descriptors_near(snapshot: &Snapshot<'_>, bounds: &BoxMm) -> Result<Vec<(u64, Descriptor)>, Failure> {
    let features = snapshot.features(Some(bounds))?.into_iter();
    let descriptor = |feature: resurvey_core::version::Feature| match feature.state {
        FeatureState::Descriptor(descriptor) => Some((feature.fid.0, descriptor)),
        FeatureState::Object { .. } => None,
    };
    Ok(features.filter_map(descriptor).collect())
}

fn observation(map: &MapFile, proposal: &Proposal) -> Result<Option<RecordedObservation>, Failure> {
    Ok(proposal.observation.map_or(Ok(None), |id| map.observation(id))?)
}

/// Its changes; additions under number 0.
fn deltas(proposal: &Proposal) -> Vec<Delta> {
    let additions = proposal.transaction.additions.iter().map(|state| Delta::add(Fid(0), state.clone()));
    proposal.transaction.deltas.iter().cloned().chain(additions).collect()
}

fn change(delta: &Delta, classes: &ClassTable) -> String {
    let place = delta.after().or(delta.before()).map_or_else(String::new, |state| super::diff::words(state, classes));
    match delta.before() {
        None => format!("add {place}"),
        Some(_) => format!("{} {} {place}", super::diff::op(delta), delta.fid()),
    }
}

fn status(proposal: &Proposal) -> &'static str {
    match proposal.status {
        ProposalStatus::Open => "open",
        ProposalStatus::Accepted(_) => "accepted",
        ProposalStatus::Rejected => "rejected",
    }
}

fn document(map: &MapFile, proposal: &Proposal, classes: &ClassTable) -> Result<Value, Failure> {
    let sides = Sides { before: classes, after: classes };
    let mut changes = deltas(proposal).iter().map(|delta| sides.document(delta)).collect::<Result<Vec<_>, _>>()?;
    changes.iter_mut().filter(|change| change["fid"] == 0).for_each(|change| change["fid"] = Value::Null);
    let version = match proposal.status {
        ProposalStatus::Accepted(version) => Some(version.0),
        _ => None,
    };
    let capture = observation(map, proposal)?.map(|seen| seen.observation.capture.to_string());
    Ok(json!({
        "id": proposal.id,
        "status": status(proposal),
        "proposed_at": proposal.proposed_at.to_string(),
        "observed_at": proposal.transaction.observed_at.map(|time| time.to_string()),
        "author": proposal.transaction.author,
        "message": proposal.transaction.message,
        "base_version": proposal.transaction.base.0,
        "capture_sha256": capture,
        "changes": changes,
        "version": version,
        "decision": proposal.decision.as_ref().map(|decision| json!({
            "at": decision.at.to_string(), "by": decision.by, "note": decision.note,
        })),
    }))
}
