//! Events, and spans as they end, each as one entry.

use serde_json::Value;
use std::fmt;
use std::marker::PhantomData;
use std::time::Instant;
use tracing::field::{Field, Visit};
use tracing::span::{Attributes, Id, Record};
use tracing::{Event, Level, Subscriber};
use tracing_log::NormalizeEvent as _;
use tracing_subscriber::layer::{Context, Layer};
use tracing_subscriber::registry::{LookupSpan, SpanRef};

/// The field that holds an event's words.
const MESSAGE: &str = "message";
/// The source of an event of `log` is in its target as well.
const OF_LOG: &str = "log.";

/// Something that happened, or a span that ended.
pub(crate) struct Entry<'a> {
    /// How grave it is.
    pub level: Level,
    /// The module that it happened in.
    pub target: &'a str,
    /// The spans around it, or those around the one that ended and its own, from the outermost, with `/` between them.
    pub span: &'a str,
    /// The words of an event.
    pub message: &'a str,
    /// Duration of the span, s.
    pub duration_s: Option<f64>,
    /// Values by name.
    pub fields: &'a [(&'static str, Value)],
}

/// Takes entries.
pub(crate) trait Sink: Send + Sync + 'static {
    /// Takes one.
    fn take(&self, entry: &Entry<'_>);
}

/// Gives entries to a sink.
pub(crate) struct LogLayer<S> {
    sink: S,
}

impl<S: Sink> LogLayer<S> {
    /// A layer for a sink.
    pub(crate) fn new(sink: S) -> Self {
        Self { sink }
    }
}

/// Data of a span until it ends, for each sink.
struct Kept<S> {
    began: Instant,
    fields: Fields,
    of: PhantomData<fn(S)>,
}

impl<S: Sink, C: Subscriber + for<'a> LookupSpan<'a>> Layer<C> for LogLayer<S> {
    fn on_new_span(&self, attributes: &Attributes<'_>, id: &Id, context: Context<'_, C>) {
        let Some(span) = context.span(id) else { return };
        let mut fields = Fields::default();
        attributes.record(&mut fields);
        span.extensions_mut().insert(Kept::<S> { began: Instant::now(), fields, of: PhantomData });
    }

    fn on_record(&self, id: &Id, values: &Record<'_>, context: Context<'_, C>) {
        let Some(span) = context.span(id) else { return };
        if let Some(kept) = span.extensions_mut().get_mut::<Kept<S>>() {
            values.record(&mut kept.fields);
        }
    }

    fn on_event(&self, event: &Event<'_>, context: Context<'_, C>) {
        let mut fields = Fields::default();
        event.record(&mut fields);
        let of_log = event.normalized_metadata();
        let about = of_log.as_ref().unwrap_or_else(|| event.metadata());
        let span = context.event_span(event).map(|span| path(&span)).unwrap_or_default();
        self.sink.take(&Entry {
            level: *about.level(),
            target: about.target(),
            span: &span,
            message: &fields.message,
            duration_s: None,
            fields: &fields.values,
        });
    }

    fn on_close(&self, id: Id, context: Context<'_, C>) {
        let Some(span) = context.span(&id) else { return };
        let Some(kept) = span.extensions_mut().remove::<Kept<S>>() else { return };
        self.sink.take(&Entry {
            level: *span.metadata().level(),
            target: span.metadata().target(),
            span: &path(&span),
            message: &kept.fields.message,
            duration_s: Some(kept.began.elapsed().as_secs_f64()),
            fields: &kept.fields.values,
        });
    }
}

fn path<C: for<'a> LookupSpan<'a>>(span: &SpanRef<'_, C>) -> String {
    span.scope().from_root().map(|span| span.name()).collect::<Vec<_>>().join("/")
}

/// Words and values of an event or a span.
#[derive(Default)]
struct Fields {
    message: String,
    values: Vec<(&'static str, Value)>,
}

impl Fields {
    fn add(&mut self, field: &Field, value: Value) {
        if field.name() == MESSAGE {
            self.message = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        } else if !field.name().starts_with(OF_LOG) {
            self.values.push((field.name(), value));
        }
    }
}

impl Visit for Fields {
    fn record_f64(&mut self, field: &Field, value: f64) {
        self.add(field, value.into());
    }

    fn record_i64(&mut self, field: &Field, value: i64) {
        self.add(field, value.into());
    }

    fn record_u64(&mut self, field: &Field, value: u64) {
        self.add(field, value.into());
    }

    fn record_bool(&mut self, field: &Field, value: bool) {
        self.add(field, value.into());
    }

    fn record_str(&mut self, field: &Field, value: &str) {
        self.add(field, value.into());
    }

    fn record_debug(&mut self, field: &Field, value: &dyn fmt::Debug) {
        self.add(field, format!("{value:?}").into());
    }
}
