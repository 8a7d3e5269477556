//! The lists of objects: who is in which.

use std::collections::BTreeMap;

use super::Reader;
use crate::finding::{Place, Rule, quoted};
use crate::ini::RawSection;
use crate::model::{List, ListSection};

impl Reader {
    pub(super) fn lists(&mut self, lists: &[(List, &RawSection<'_>)]) {
        let mut listed: BTreeMap<u16, Place> = BTreeMap::new();
        for (list, section) in lists {
            let mut kept = ListSection {
                comments: section.comments.clone(),
                inner_comments: section.inner.clone(),
                extra: Vec::new(),
            };
            let mut count = 0;
            let mut claimed = None;
            for key in &section.keys {
                if key.key.eq_ignore_ascii_case("SupportedObjects") {
                    claimed = Some(key);
                } else if key.key.bytes().all(|byte| byte.is_ascii_digit()) {
                    count += 1;
                    let Some(number) = self.number(key) else {
                        continue;
                    };
                    let Ok(index) = u16::try_from(number) else {
                        self.no_number(key);
                        continue;
                    };
                    self.listed(*list, index, key.value_at, &mut listed);
                } else {
                    kept.extra.push((key.key.to_owned(), key.value.to_owned()));
                }
            }
            if let Some(key) = claimed
                && let Some(number) = self.number(key)
                && number != count
            {
                let what = format!("SupportedObjects is {number}, but {count} are listed");
                let advice = "all that are listed are used; correct the count";
                self.add(Rule::WrongCount, key.value_at, what, advice);
            } else if claimed.is_none() {
                let what = format!("[{}] has no SupportedObjects", section.name);
                let advice = format!("write SupportedObjects={count}");
                self.add(Rule::WrongCount, section.at, what, &advice);
            }
            if let Some(place) = self.eds.lists.get_mut(*list as usize) {
                *place = kept;
            }
        }
        let missing = self
            .eds
            .objects
            .keys()
            .filter(|index| !listed.contains_key(index));
        for index in missing.copied().collect::<Vec<u16>>() {
            let at = self.places.get(&(index, None)).map(|places| places.header);
            let name = List::of(index).section();
            let what = format!("the object {index:04X} is in no list");
            let advice = format!("[{name}] is assumed; other programs pass such objects over");
            self.add(Rule::NotListed, at.unwrap_or_default(), what, &advice);
        }
    }

    fn listed(&mut self, list: List, index: u16, at: Place, listed: &mut BTreeMap<u16, Place>) {
        if let Some(first) = listed.get(&index) {
            let what = format!(
                "the object {index:04X} is listed in line {} already",
                first.line
            );
            self.add(
                Rule::ListedTwice,
                at,
                what,
                "the first place counts; remove one",
            );
            return;
        }
        listed.insert(index, at);
        let Some(object) = self.eds.objects.get_mut(&index) else {
            let what = format!("the object {index:04X} is listed, but not described");
            let advice = "it is not used; add its section or remove it here";
            self.add(Rule::ListedMissing, at, what, advice);
            return;
        };
        object.list = list;
        let is_manufacturer = List::of(index) == List::Manufacturer;
        if is_manufacturer != (list == List::Manufacturer) {
            let what = format!("the object {index:04X} is in [{}]", list.section());
            let right = List::of(index).section();
            let advice = format!("kept there; by its index it belongs to {}", quoted(right));
            self.add(Rule::WrongList, at, what, &advice);
        }
    }
}
