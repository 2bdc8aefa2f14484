//! The derive of `Keys`: from one declaration of a table of case files come its reading, its copy with every default,
//! its schema, its page of the reference and `sazanami explain`.
//!
//! A field of a struct is a key of the table; its doc comment is what the reference says of it. `#[key(...)]` takes
//!
//! | entry | meaning |
//! |---|---|
//! | `unit = "m"` | SI unit; the case gives any unit of that dimension |
//! | `quantity = "a surface tension"` | which of several kinds of quantity with that unit |
//! | `range = Positive` | range that numbers lie in (a variant of `Range1`) |
//! | `within = expr` | range that is known only with the rest of the case |
//! | `least = 1`, `most = 200` | limits of a whole number |
//! | `default = expr` | value where the case says nothing; `cx` and the fields before may be used |
//! | `default` | that of the type |
//! | `says = "2.5 d"` | words for a default that depends on the case, as a text or an expression |
//! | `meant = expr` | value that an `Option` without default comes to mean, for the reference |
//! | `paper_literal = (Yagyu, expr, "why")` | default of the preset `paper_literal`, by whose paper, and the reason |
//! | `word` | the value is a word of a `Choice` |
//! | `table`, `tables` | a table of keys of its own, or a list of them, of which one may stand alone |
//! | `from_nothing` | where the table is left out, all its keys have their defaults |
//! | `named` | the table holds tables by names of the user's choice |
//! | `via = Type` | tuple struct that reads and writes the value |
//! | `shared` | later tables find it in `cx.known` |
//! | `flatten` | keys of another type that stand in this table |
//! | `flatten`, `via = Type`, `then = expr` | those of `Type`, bound to the field's name in `expr`, which makes the value once all others are read; `Type::of` makes them from it |
//! | `skip = expr` | no key: computed |
//! | `name = "liquid"` | name of the key, where it is not that of the field |
//! | `example = "0.02 s"` | what the message about its absence suggests |
//! | `inline`, `dotted` | how the copy shows a table: `{ ... }` on the line, or `key.variant = { ... }` |
//! | `omit_if = expr` | when the copy leaves the key out |
//!
//! A field without `default` that is no `Option` has to be given. An enumeration is a choice between tables: unit
//! variants are words, variants with fields are `{ variant = { ... } }`. `#[keys(check = path)]` names a function that
//! is called with the struct, its table and the context once all keys are read.
//!
//! `#[keys_of(Type)]` over such a declaration makes `Type`, of a crate below, the table: the declared fields are fields of
//! it, every one of them, and nothing else is left of the declaration.

mod attributes;

use attributes::{Attributes, Form, about, inner_of};
use proc_macro::TokenStream;
use proc_macro2::TokenStream as Tokens;
use quote::{format_ident, quote};
use syn::{Data, DeriveInput, Fields, FieldsNamed, Ident, Type, Variant, parse_macro_input, parse_quote};

/// See the crate.
#[proc_macro_derive(Keys, attributes(key, keys))]
pub fn derive_keys(input: TokenStream) -> TokenStream {
    let input = parse_macro_input!(input as DeriveInput);
    let name = &input.ident;
    expand(&input, &parse_quote!(#name)).unwrap_or_else(syn::Error::into_compile_error).into()
}

/// See the crate.
#[proc_macro_attribute]
pub fn keys_of(target: TokenStream, input: TokenStream) -> TokenStream {
    let (target, input) = (parse_macro_input!(target as Type), parse_macro_input!(input as DeriveInput));
    expand(&input, &target).unwrap_or_else(syn::Error::into_compile_error).into()
}

/// The implementation of `Keys` for the type `name`.
fn expand(input: &DeriveInput, name: &Type) -> syn::Result<Tokens> {
    let label = input.ident.to_string();
    let meaning = about(&input.attrs);
    let body = match &input.data {
        Data::Struct(data) => {
            let Fields::Named(fields) = &data.fields else {
                return Err(syn::Error::new_spanned(name, "keys are named fields"));
            };
            let table = TableOf::new(fields, |field| quote!(&self.#field))?;
            let (docs, TableOf { reads, names, write, .. }) = (table.docs(&label, &meaning), table);
            let check = attributes::check_of(&input.attrs)?.map(|path| quote!(#path(&mut this, table, cx);));
            quote! {
                fn docs() -> crate::key::TableDoc { #docs }

                #[allow(unused_mut)]
                fn read(at: &crate::read::At<'_>, cx: &mut crate::read::Context<'_>) -> Option<Self> {
                    let table = &cx.open(at, Self::docs())?;
                    #reads
                    let mut this = Self { #(#names),* };
                    #check
                    Some(this)
                }

                fn write(&self, style: crate::write::Paths) -> crate::write::Written { #write }
            }
        }
        Data::Enum(data) => expand_enum(data, &label, &meaning)?,
        Data::Union(_) => return Err(syn::Error::new_spanned(name, "a union has no keys")),
    };
    Ok(quote! {
        impl crate::key::Keys for #name {
            #body
        }
    })
}

/// Code that reads and writes a table with the keys of named fields.
struct TableOf {
    names: Vec<Ident>,
    docs: Tokens,
    reads: Tokens,
    write: Tokens,
}

impl TableOf {
    /// `reference` leads to a field where the table is written.
    fn new(fields: &FieldsNamed, reference: impl Fn(&Ident) -> Tokens) -> syn::Result<Self> {
        let keys = declared(fields)?;
        let entries = keys.iter().map(|key| key.write(&reference(&key.field)));
        Ok(Self {
            docs: keys.iter().map(Key::docs).collect(),
            reads: keys
                .iter()
                .map(|key| key.read(&quote!(table)))
                .chain(keys.iter().filter_map(Key::meaning))
                .collect(),
            write: quote! {
                let mut entries = crate::write::Entries::default();
                #(#entries)*
                crate::write::Written::Table(entries)
            },
            names: keys.into_iter().map(|key| key.field).collect(),
        })
    }

    fn docs(&self, name: &str, about: &str) -> Tokens {
        let docs = &self.docs;
        quote! {
            let mut keys: Vec<crate::key::KeyDoc> = Vec::new();
            #docs
            crate::key::TableDoc { name: #name, about: #about, keys, is_choice: false }
        }
    }
}

/// A variant of a choice: what adds its documentation to `keys`, and its arms of reading and writing.
fn expand_variant(variant: &Variant, label: &str) -> syn::Result<[Tokens; 3]> {
    let attributes = Attributes::of(&variant.attrs)?;
    let (ident, about) = (&variant.ident, about(&variant.attrs));
    if attributes.absent {
        return Ok([quote!(), quote!(), quote!(Self::#ident => crate::write::Written::Nothing,)]);
    }
    let word = attributes.name.unwrap_or_else(|| attributes::snake(&ident.to_string()));
    Ok(match &variant.fields {
        Fields::Unit => [
            quote!(keys.push(crate::key::KeyDoc::word(#word, #about));),
            quote!(#word => Some(Self::#ident),),
            quote!(Self::#ident => crate::write::Written::Leaf(format!("\"{}\"", #word)),),
        ],
        Fields::Named(fields) => {
            let table = TableOf::new(fields, |field| quote!(#field))?;
            let docs_of = format_ident!("docs_of_{word}");
            let (docs, TableOf { reads, names, write, .. }) = (table.docs(&format!("{label}{ident}"), &about), table);
            [
                quote! {
                    fn #docs_of() -> crate::key::TableDoc { #docs }
                    keys.push(crate::key::KeyDoc::nested(#word, #about, #docs_of, false));
                },
                quote! {
                    #word => {
                        let table = &cx.open(&at, docs.keys[number].nested_docs())?;
                        #reads
                        Some(Self::#ident { #(#names),* })
                    }
                },
                quote!(Self::#ident { #(#names),* } => crate::write::Written::variant(#word, { #write }),),
            ]
        }
        Fields::Unnamed(fields) => {
            let Some(field) = fields.unnamed.first().filter(|_| fields.unnamed.len() == 1) else {
                return Err(syn::Error::new_spanned(ident, "a variant holds one table"));
            };
            let (inner, many, read, written) = match inner_of(&field.ty, "Vec") {
                Some(inner) => (
                    inner,
                    true,
                    quote!(cx.tables::<#inner>(&at)?),
                    quote!(crate::write::Written::tables(inner, style)),
                ),
                None => {
                    let inner = &field.ty;
                    let read = quote!(<#inner as crate::key::Keys>::read(&at, cx)?);
                    (inner, false, read, quote!(crate::key::Keys::write(inner, style)))
                }
            };
            [
                quote!(keys.push(crate::key::KeyDoc::nested(#word, #about, <#inner as crate::key::Keys>::docs, #many));),
                quote!(#word => Some(Self::#ident(#read)),),
                quote!(Self::#ident(inner) => crate::write::Written::variant(#word, #written),),
            ]
        }
    })
}

fn expand_enum(data: &syn::DataEnum, label: &str, meaning: &str) -> syn::Result<Tokens> {
    let [mut docs, mut reads, mut writes] = [const { Vec::new() }; 3];
    for variant in &data.variants {
        let [doc, read, write] = expand_variant(variant, label)?;
        docs.push(doc);
        reads.push(read);
        writes.push(write);
    }
    Ok(quote! {
        fn docs() -> crate::key::TableDoc {
            let mut keys: Vec<crate::key::KeyDoc> = Vec::new();
            #(#docs)*
            crate::key::TableDoc { name: #label, about: #meaning, keys, is_choice: true }
        }

        fn read(at: &crate::read::At<'_>, cx: &mut crate::read::Context<'_>) -> Option<Self> {
            let docs = Self::docs();
            let (number, at) = cx.alternative(at, &docs)?;
            match docs.keys[number].name {
                #(#reads)*
                _ => None,
            }
        }

        #[allow(unused_variables)]
        fn write(&self, style: crate::write::Paths) -> crate::write::Written {
            match self {
                #(#writes)*
            }
        }
    })
}

/// A key of a table.
struct Key {
    field: syn::Ident,
    /// Type without `Option`.
    kind: Type,
    optional: bool,
    about: String,
    attributes: Attributes,
}

fn declared(fields: &FieldsNamed) -> syn::Result<Vec<Key>> {
    let key = |field: &syn::Field| {
        let attributes = Attributes::of(&field.attrs)?;
        let inner = inner_of(&field.ty, "Option");
        let ident = field.ident.clone().ok_or_else(|| syn::Error::new_spanned(field, "a key has a name"))?;
        Ok(Key {
            field: ident,
            kind: inner.unwrap_or(&field.ty).clone(),
            optional: inner.is_some(),
            about: about(&field.attrs),
            attributes,
        })
    };
    fields.named.iter().map(key).collect()
}

impl Key {
    fn name(&self) -> String {
        let field = self.field.to_string();
        self.attributes.name.clone().unwrap_or_else(|| field.trim_start_matches("r#").to_owned())
    }

    /// Type that reads and writes a single value.
    fn leaf(&self) -> Tokens {
        let kind = &self.kind;
        match &self.attributes.via {
            Some(via) => quote!(#via),
            None if self.attributes.word => quote!(crate::value::Word<#kind>),
            None => quote!(#kind),
        }
    }

    /// Type of keys that stand in the same table.
    fn flattened(&self) -> Tokens {
        let kind = &self.kind;
        self.attributes.via.as_ref().map_or(quote!(#kind), |via| quote!(#via))
    }

    /// Makes the value from flattened keys.
    fn meaning(&self) -> Option<Tokens> {
        let (field, meaning) = (&self.field, self.attributes.then.as_ref()?);
        Some(quote!(let #field = #meaning;))
    }

    fn docs(&self) -> Tokens {
        let Attributes { unit, quantity, range, count, default, says, meant, literal, example, form, .. } =
            &self.attributes;
        let (name, about, kind) = (self.name(), &self.about, &self.kind);
        let says = says.as_ref().map(|text| quote!(key.default = crate::key::DefaultDoc::Text(#text.into());));
        let example = example.as_ref().map(|text| quote!(key.example = Some(#text);));
        match form {
            Form::Skip(_) => return quote!(),
            Form::Flatten => {
                let kind = self.flattened();
                return quote!(keys.extend(<#kind as crate::key::Keys>::docs().keys););
            }
            Form::Table | Form::Tables => {
                let (inner, many) = match form {
                    Form::Tables => (inner_of(kind, "Vec").unwrap_or(kind), true),
                    _ => (kind, false),
                };
                let named = self
                    .attributes
                    .named
                    .then(|| quote!(key.value = crate::key::ValueDoc::Named(<#inner as crate::key::Keys>::docs);));
                let required = !self.optional && default.is_none() && !many && !self.attributes.from_nothing;
                return quote! {
                    let mut key =
                        crate::key::KeyDoc::nested(#name, #about, <#inner as crate::key::Keys>::docs, #many);
                    #named
                    if #required {
                        key.default = crate::key::DefaultDoc::Required;
                    }
                    #says
                    #example
                    keys.push(key);
                };
            }
            Form::Value => {}
        }
        let leaf = self.leaf();
        let named = quantity.as_ref().map_or(quote!(None), |name| quote!(Some(#name)));
        let unit =
            unit.as_ref().map(|unit| quote!(key.unit = Some(const { crate::units::Quantity::of(#unit, #named) });));
        let range = range
            .as_ref()
            .map(|range| quote!(key.range = { #[allow(unused_imports)] use crate::value::Range1::*; #range };));
        let [least, most] = count;
        let least = least.as_ref().map(|n| quote!(key.count[0] = #n;));
        let most = most.as_ref().map(|n| quote!(key.count[1] = #n;));
        let default = match (says, default.as_ref().or(meant.as_ref())) {
            (Some(says), _) => Some(says),
            (None, Some(default)) => {
                let value = self.wrapped(&quote!(#default));
                Some(quote!(key.default = crate::key::DefaultDoc::Text(crate::value::Value::show(&#value, &key));))
            }
            (None, None) => self.optional.then(|| quote!(key.default = crate::key::DefaultDoc::None;)),
        };
        let literal = literal.as_ref().map(|(paper, value, reason, says)| {
            let value = match says {
                Some(says) => quote!(#says.to_owned()),
                None => {
                    let value = self.wrapped(&quote!(#value));
                    quote!(crate::value::Value::show(&#value, &key))
                }
            };
            quote!(key.literal = Some(crate::key::Literal {
                paper: crate::presets::Paper::#paper, value: #value, reason: #reason,
            });)
        });
        quote! {
            let mut key = crate::key::KeyDoc::leaf::<#leaf>(#name, #about);
            #unit #range #least #most #default #literal #example
            keys.push(key);
        }
    }

    /// A value of the field as one that shows itself.
    fn wrapped(&self, value: &Tokens) -> Tokens {
        let kind = &self.kind;
        match &self.attributes.via {
            Some(via) => quote!(#via(#value)),
            None if self.attributes.word => quote!(crate::value::Word::<#kind>(#value)),
            None => quote!({ let value: #kind = #value; value }),
        }
    }

    /// The default where the case says nothing, of the type without `Option` but with it where it is optional.
    fn default(&self) -> Option<Tokens> {
        let kind = &self.kind;
        let plain = match (&self.attributes.default, self.optional) {
            (Some(default), true) => Some(quote!(Some(#default))),
            (Some(default), false) => Some(quote!(#default)),
            (None, true) => Some(quote!(None::<#kind>)),
            (None, false) => None,
        }?;
        Some(match &self.attributes.literal {
            Some((paper, value, _, _)) => {
                let value = if self.optional { quote!(Some(#value)) } else { quote!(#value) };
                quote!(if cx.follows(crate::presets::Paper::#paper) { #value } else { #plain })
            }
            None => plain,
        })
    }

    /// Reads the key, and keeps it in the context where later tables need it.
    fn read(&self, table: &Tokens) -> Tokens {
        let (read, field) = (self.read_alone(table), &self.field);
        let kept = self.attributes.shared.then(|| quote!(cx.known.#field = Clone::clone(&#field);));
        quote!(#read #kept)
    }

    fn read_alone(&self, table: &Tokens) -> Tokens {
        let (field, name, kind) = (&self.field, self.name(), &self.kind);
        match &self.attributes.form {
            Form::Skip(value) => return quote!(let #field = #value;),
            Form::Flatten => {
                let kind = self.flattened();
                return quote!(let #field = <#kind as crate::key::Keys>::read(&#table.part(), cx)?;);
            }
            Form::Tables => {
                let inner = inner_of(kind, "Vec").unwrap_or(kind);
                return quote! {
                    let child = #table.child(#name, cx);
                    let #field = cx.tables::<#inner>(&child).unwrap_or_default();
                };
            }
            Form::Table => {
                let given = quote! {
                    let #field = if #table.has(#name) {
                        <#kind as crate::key::Keys>::read(&#table.child(#name, cx), cx)
                    } else {
                        None
                    };
                };
                if self.optional {
                    return given;
                }
                return match (&self.attributes.default, self.attributes.from_nothing) {
                    (Some(default), _) => quote! {
                        #given
                        let #field = match #field {
                            Some(value) => value,
                            None => #default,
                        };
                    },
                    (None, true) => quote! {
                        let child = #table.child(#name, cx);
                        let #field = match <#kind as crate::key::Keys>::read(&child, cx) {
                            Some(value) => value,
                            None => <#kind as crate::key::Keys>::read(&child.empty(), cx)?,
                        };
                    },
                    (None, false) => quote! {
                        if !#table.has(#name) {
                            #table.missing(#name, cx);
                        }
                        #given
                        let Some(#field) = #field else { #table.give_up(cx); return None };
                    },
                };
            }
            Form::Value => {}
        }
        let leaf = self.leaf();
        let within = match &self.attributes.within {
            Some(range) => quote!(Some({ #[allow(unused_imports)] use crate::value::Range1::*; #range })),
            None => quote!(None),
        };
        let unwrap = if self.attributes.word || self.attributes.via.is_some() { quote!(.0) } else { quote!() };
        let (value, wrong) = if self.optional {
            (quote!(Some(value #unwrap)), quote!(<#leaf as crate::value::Value>::wrong().map(|value| value #unwrap)))
        } else {
            (quote!(value #unwrap), quote!())
        };
        let (absent, wrong) = match self.default() {
            Some(default) if self.optional => (default, wrong),
            Some(default) => (
                default.clone(),
                quote!(match <#leaf as crate::value::Value>::wrong() { Some(value) => value #unwrap, None => #default }),
            ),
            None => (
                quote!({ #table.missing(#name, cx); <#leaf as crate::value::Value>::blank() #unwrap }),
                quote!(<#leaf as crate::value::Value>::blank() #unwrap),
            ),
        };
        // A default that depends on the case may not fit it: that is said here, not of the copy.
        let absent = if self.attributes.within.is_some() && !self.optional && self.attributes.default.is_some() {
            quote!({
                let value = #absent;
                #table.check_default(#name, { let within = #within; within }, value, cx);
                value
            })
        } else {
            absent
        };
        quote! {
            let #field = match { let within = #within; #table.value::<#leaf>(#name, within, cx) } {
                crate::value::Given::Value(value) => #value,
                crate::value::Given::Absent => #absent,
                crate::value::Given::Wrong => #wrong,
            };
        }
    }

    /// Adds the key to `entries`, from a reference to the field.
    fn write(&self, field: &Tokens) -> Tokens {
        let name = self.name();
        let unit = self.attributes.unit.clone().unwrap_or_default();
        let show = &self.attributes.show;
        let entry = match &self.attributes.form {
            Form::Skip(_) => return quote!(),
            Form::Flatten => {
                let keys = self.attributes.via.as_ref().map_or(quote!(#field), |via| quote!(&#via::of(#field)));
                return quote!(entries.extend(crate::key::Keys::write(#keys, style)););
            }
            Form::Tables => quote!(entries.push(#name, crate::write::Written::tables(value, style), #show);),
            Form::Table => quote!(entries.push(#name, crate::key::Keys::write(value, style), #show);),
            Form::Value if self.attributes.word => {
                quote!(entries.leaf(#name, crate::value::Value::write(&crate::value::Word(*value), #unit, style));)
            }
            Form::Value if self.attributes.via.is_some() => {
                let via = &self.attributes.via;
                quote!(entries.leaf(#name, crate::value::Value::write(&#via(*value), #unit, style));)
            }
            Form::Value => quote!(entries.leaf(#name, crate::value::Value::write(value, #unit, style));),
        };
        let entry = if self.optional {
            quote!(if let Some(value) = #field { #entry })
        } else {
            quote!({ let value = #field; #entry })
        };
        match &self.attributes.omit_if {
            Some(condition) => quote!(if !(#condition) { #entry }),
            None => entry,
        }
    }
}
