//! One instance of a plugin: made, called, ended, and never used again after a panic.
#![allow(unsafe_code)]

use super::check::Violation;
use super::error::PluginError;
use super::open::Plugin;
use super::settings::Settings;
use resurvey_schema::abi::{self, Growing, STATUS_CANCELLED, STATUS_OK, STATUS_PANICKED, Status, Text};
use std::ptr::null_mut;

/// Bytes lent for the text of an error; longer ones are cut by the plugin.
const ERROR_BYTES: usize = 2048;

/// Where a plugin writes the text of an error.
#[derive(Debug)]
pub(super) struct ErrorBuffer(Vec<u8>);

impl ErrorBuffer {
    pub(super) fn new() -> Self {
        Self(vec![0; ERROR_BYTES])
    }

    /// Lent until `self` is used again.
    pub(super) fn lend(&mut self) -> abi::ErrorText {
        abi::ErrorText { capacity: ERROR_BYTES as u32, data: self.0.as_mut_ptr(), ..abi::ErrorText::new() }
    }

    /// What the plugin wrote.
    pub(super) fn text(&self, error: &abi::ErrorText) -> String {
        let written = &self.0[..ERROR_BYTES.min(error.length as usize)];
        if written.is_empty() { "no reason given".to_owned() } else { String::from_utf8_lossy(written).into_owned() }
    }
}

/// A live instance.
#[derive(Debug)]
pub(super) struct Instance {
    plugin: Plugin,
    table: abi::Table,
    pointer: *mut abi::Instance,
    poisoned: bool,
    error: ErrorBuffer,
}

// SAFETY: the header asks of a plugin that an instance may move between threads; it is called through `&mut` alone.
unsafe impl Send for Instance {}

impl Instance {
    /// An instance of `plugin`, whose entry filled in `table`.
    pub(super) fn create(plugin: Plugin, table: abi::Table, settings: &Settings) -> Result<Self, PluginError> {
        let create = table.create.expect("invariant: `enter` refuses a table without create");
        let mut instance = Self { plugin, table, pointer: null_mut(), poisoned: false, error: ErrorBuffer::new() };
        let mut error = instance.error.lend();
        let text = Text::of(settings.as_json());
        // SAFETY: the function came from the plugin's own entry; text, place and buffer live until it returns.
        let status = unsafe { create(text, &raw mut instance.pointer, &raw mut error) };
        if status != STATUS_OK {
            // Whatever a plugin has left there, it has made no instance that is to be ended.
            instance.pointer = null_mut();
        }
        instance.check("create", status, &error, false)?;
        Ok(instance)
    }

    pub(super) fn plugin(&self) -> &Plugin {
        &self.plugin
    }

    pub(super) fn name(&self) -> String {
        self.plugin.info().name.clone()
    }

    /// Runs one call; `body` gets the instance and the buffer for its error and gives the status back.
    pub(super) fn call(
        &mut self,
        call: &'static str,
        cancelled: impl FnOnce() -> bool,
        body: impl FnOnce(&abi::Table, *mut abi::Instance, *mut abi::ErrorText) -> Status,
    ) -> Result<(), PluginError> {
        if self.poisoned {
            return Err(PluginError::Poisoned { plugin: self.name() });
        }
        let mut error = self.error.lend();
        let status = body(&self.table, self.pointer, &raw mut error);
        let cancelled = cancelled();
        if status == STATUS_OK && !cancelled {
            return Ok(());
        }
        self.check(call, status, &error, cancelled)
    }

    fn check(
        &mut self,
        call: &'static str,
        status: Status,
        error: &abi::ErrorText,
        cancelled: bool,
    ) -> Result<(), PluginError> {
        let (plugin, text) = (self.name(), self.error.text(error));
        match status {
            STATUS_PANICKED => {
                self.poisoned = true;
                Err(PluginError::Panicked { plugin, call, text })
            }
            // What is done after a cancel may be done by half.
            _ if cancelled || status == STATUS_CANCELLED => Err(PluginError::Cancelled { plugin, call }),
            STATUS_OK => Ok(()),
            _ => Err(PluginError::Failed { plugin, call, text }),
        }
    }

    pub(super) fn invalid(&self, call: &'static str, Violation { field, value, expected }: Violation) -> PluginError {
        PluginError::InvalidOutput { plugin: self.name(), call, field, value, expected }
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        if let Some(destroy) = self.table.destroy
            && !self.pointer.is_null()
        {
            // SAFETY: the instance came from `create` of the same table and is ended here, once.
            unsafe { destroy(self.pointer) };
        }
    }
}
