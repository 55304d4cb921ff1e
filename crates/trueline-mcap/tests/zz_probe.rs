mod common;
use common::*;
use std::collections::HashSet;
#[test]
fn exhaustive() {
    for (name, file) in [("unfinished", unfinished(entries(40))), ("finished", recorded(entries(40)))] {
        let (w, known) = read_items(&file);
        let whole: HashSet<String> = w.iter().map(|i| format!("{i:?}")).collect();
        println!("{name} {} bytes {known:?}", file.len());
        let mut at = 8;
        while at + 9 <= file.len() { let n = u64::from_le_bytes(file[at+1..at+9].try_into().unwrap()) as usize; print!("{:#x}@{at}+{n} ", file[at]); at += 9+n; }
        println!();
        let limit = file.len().min(17000);
        for byte in 0..limit { for bit in 0..8 {
            let mut g = file.clone(); g[byte] ^= 1 << bit;
            let (items, d) = read_items(&g);
            let told = d.iter().any(|x| !known.contains(x)) || d.len() < known.len();
            let altered: Vec<_> = items.iter().map(|i| format!("{i:?}")).filter(|i| !whole.contains(i)).collect();
            if !told && (!altered.is_empty() || items.len() < w.len()) { println!("{byte}.{bit}: altered {} less {}: {}", altered.len(), w.len() as i64 - items.len() as i64, altered.first().map_or("", |s| &s[..s.len().min(300)])); }
        } }
    }
}
