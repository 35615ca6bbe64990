//! Turns a panic into its text with file and line, and prints nothing.

use std::any::Any;
use std::cell::{Cell, RefCell};
use std::panic::{AssertUnwindSafe, PanicHookInfo, catch_unwind, resume_unwind, set_hook, take_hook};
use std::sync::Once;

thread_local! {
    static DEPTH: Cell<u32> = const { Cell::new(0) };
    static LAST: RefCell<Option<String>> = const { RefCell::new(None) };
}

/// A panic of another thread, on its way through this one.
struct Forwarded(String);

/// The value of `body`, or the text of its panic.
pub(crate) fn caught<R>(body: impl FnOnce() -> R) -> Result<R, String> {
    static HOOK: Once = Once::new();
    HOOK.call_once(install_hook);
    DEPTH.set(DEPTH.get() + 1);
    // Unwind safety: whoever calls this uses nothing that `body` touched after a panic.
    let outcome = catch_unwind(AssertUnwindSafe(body));
    DEPTH.set(DEPTH.get() - 1);
    outcome.map_err(|payload| match payload.downcast::<Forwarded>() {
        Ok(forwarded) => forwarded.0,
        Err(payload) => LAST.take().unwrap_or_else(|| message(payload.as_ref()).to_owned()),
    })
}

/// Panics again, in this thread, with a text that [`caught`] gave in another one.
pub(crate) fn forward(text: String) -> ! {
    resume_unwind(Box::new(Forwarded(text)))
}

/// Location is known to the hook alone. A library has a hook of its own; a plugin that is linked in shares the host's, which
/// goes on to serve every panic outside of a call.
fn install_hook() {
    let previous = take_hook();
    set_hook(Box::new(move |info: &PanicHookInfo<'_>| {
        if DEPTH.get() == 0 {
            return previous(info);
        }
        let place = info.location().map_or_else(String::new, |at| format!(" at {}:{}", at.file(), at.line()));
        LAST.set(Some(format!("{}{place}", message(info.payload()))));
    }));
}

fn message(payload: &(dyn Any + Send)) -> &str {
    let text = payload.downcast_ref::<&str>().copied();
    text.or_else(|| payload.downcast_ref::<String>().map(String::as_str)).unwrap_or("no message")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_told_with_its_file_and_line() {
        let line = line!() + 1;
        let text = caught(|| panic!("no window in view {}", 7)).unwrap_err();
        assert_eq!(text, format!("no window in view 7 at {}:{line}", file!()));
    }

    #[test]
    fn a_forwarded_panic_keeps_the_text_of_the_first_thread() {
        let first = std::thread::spawn(|| caught(|| panic!("first")).unwrap_err()).join().unwrap();
        let expected = first.clone();
        let text = caught(|| {
            let _ = catch_unwind(|| panic!("handled by the plugin itself"));
            forward(first)
        });
        assert_eq!(text, Err::<(), _>(expected));
    }
}
