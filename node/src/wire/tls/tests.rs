//! Keys and certificates as they lie in files; what connections make of them is in `wire/tests.rs`.

use std::{
    fs,
    os::unix::fs::PermissionsExt,
    time::{Duration, SystemTime},
};

use super::*;
use crate::{
    error::ExitCode,
    limits::{CERTIFICATE_VALIDITY, EXPIRY_WARNING, NAME_BYTES},
};

#[test]
fn a_certificate_says_role_and_name() {
    let authority = Authority::new().unwrap();
    for &role in Role::ALL {
        let identity = authority.issue(role, "attic-2").unwrap();
        assert_eq!(*identity.peer(), Peer { role, name: "attic-2".to_owned() });
    }
    let above = authority.issue(Role::Node, "x").unwrap().authority().cloned().unwrap();
    assert!(Certificate::read(&[above]).is_err(), "the authority itself has no role");
}

#[test]
fn names_that_could_mislead_are_refused() {
    let authority = Authority::new().unwrap();
    for name in ["", "a b", "a/b", "a\n", "ä", &"x".repeat(NAME_BYTES + 1)] {
        assert_eq!(authority.issue(Role::Node, name).err().unwrap().code, ExitCode::Usage, "{name:?}");
    }
}

#[test]
fn keys_come_back_from_their_folder_and_are_their_owners_alone() {
    let folder = tempfile::tempdir().unwrap();
    Authority::new().unwrap().save(folder.path()).unwrap();
    let authority = Authority::load(folder.path()).unwrap();
    assert!(authority.save(folder.path()).is_err(), "a second authority never overwrites the first");
    let path = authority.issue(Role::Node, "attic").unwrap().save(folder.path()).unwrap();
    assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o600);
    assert_eq!(Identity::load(folder.path(), Role::Node).unwrap().peer().name, "attic");
    assert!(Identity::load_client(&path).err().unwrap().message.contains("an identity of a node"));
    authority.issue(Role::Node, "cellar").unwrap().save(folder.path()).unwrap();
    assert!(Identity::load(folder.path(), Role::Node).err().unwrap().message.contains("several"));
    fs::set_permissions(&path, fs::Permissions::from_mode(0o644)).unwrap();
    assert!(Identity::load(&path, Role::Node).err().unwrap().help.unwrap().contains("chmod 600"));
}

#[test]
fn the_end_of_a_certificate_is_said_before_and_after() {
    let identity = Authority::new().unwrap().issue(Role::Node, "attic").unwrap();
    let certificate = &identity.certificate;
    let age = SystemTime::now().duration_since(certificate.issued).unwrap();
    assert!(age < Duration::from_secs(60), "{age:?}");
    assert_eq!(certificate.check_time(certificate.issued).unwrap(), None);
    let close = certificate.expires - EXPIRY_WARNING / 2;
    assert!(certificate.check_time(close).unwrap().unwrap().contains("node attic expires at 20"));
    let late = certificate.issued + CERTIFICATE_VALIDITY + Duration::from_secs(2);
    assert!(certificate.check_time(late).unwrap_err().contains("expired"));
}

#[test]
fn an_expired_identity_is_refused_where_it_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let authority = Authority::new().unwrap();
    authority.issue_for(Role::Operator, "old", Duration::ZERO).unwrap().save(folder.path()).unwrap();
    let error = Identity::load_client(folder.path()).err().unwrap();
    assert_eq!(error.code, ExitCode::Denied);
    assert!(error.message.contains("expired") && error.help.unwrap().contains("renew"));
}

/// Who may do what: the table of the operator's guide.
#[test]
fn roles_may_do_what_the_guide_says() {
    let deeds = [
        (Deed::Look, false),
        (Deed::Submit, false),
        (Deed::Fetch, true),
        (Deed::Fetch, false),
        (Deed::Cancel, true),
        (Deed::Cancel, false),
        (Deed::Release, false),
    ];
    for (role, may) in [
        (Role::Operator, [true, true, true, true, true, true, true]),
        (Role::Submitter, [true, true, true, false, true, false, false]),
        (Role::Observer, [true, false, false, false, false, false, false]),
        (Role::Node, [false; 7]),
        (Role::Coordinator, [false; 7]),
    ] {
        assert_eq!(deeds.map(|(deed, own)| role.may(deed, own)), may, "{role}");
    }
}

#[test]
fn a_token_is_believed_while_it_lasts_and_where_it_was_made() {
    let authority = Authority::new().unwrap();
    let issuer = authority.delegate().unwrap();
    let (token, text) = issuer.make_token(Role::Node, Some("attic".to_owned()), 1, Duration::from_secs(60)).unwrap();
    let now = SystemTime::now();
    assert_eq!(issuer.check_token(&format!(" {text}\n"), now).unwrap(), token);
    assert_eq!(Token::read(&text).unwrap(), token);
    assert_eq!(Some(token.authority), issuer.issue(Role::Node, "x").unwrap().authority_fingerprint().map(|print| *print.as_bytes()));
    assert!(issuer.check_token(&text, now + Duration::from_secs(61)).unwrap_err().contains("expired"));
    assert!(authority.delegate().unwrap().check_token(&text, now).unwrap_err().contains("not made with the issuer"));
    let mut forged = text.clone().into_bytes();
    let place = forged.len() / 2;
    forged[place] = if forged[place] == b'a' { b'b' } else { b'a' };
    assert!(issuer.check_token(std::str::from_utf8(&forged).unwrap(), now).is_err());
    assert!(Token::read("no token").is_err() && Token::read(&text[..text.len() - 8]).is_err_and(|error| error.contains("no join token")));
}

#[test]
fn a_list_revokes_what_it_names_and_nothing_younger() {
    let folder = tempfile::tempdir().unwrap();
    let authority = Authority::new().unwrap();
    let issuer = authority.delegate().unwrap();
    let (attic, cellar) =
        (authority.issue(Role::Node, "attic").unwrap().certificate, issuer.issue(Role::Node, "cellar").unwrap().certificate);
    let path = folder.path().join("revoked");
    let with = |entry: Revocation| {
        let mut list = Revocations::default();
        list.add(entry);
        fs::write(&path, list.text().unwrap()).unwrap();
        Revocations::read(&path).unwrap()
    };
    assert!(Revocations::read(&path).unwrap().is_empty(), "no list revokes nothing");
    let list = with(Revocation::now(Revoked::Name("attic".to_owned()), "stolen"));
    assert_eq!(list.refuse(&attic).unwrap(), "the certificate of node attic was revoked: stolen");
    assert_eq!(list.refuse(&cellar), None);
    let younger = Certificate { issued: attic.issued + Duration::from_secs(2), ..attic.clone() };
    assert_eq!(list.refuse(&younger), None, "a name may come back with a new key");
    let list = with(Revocation::now(Revoked::Certificate(cellar.fingerprint.to_string()), ""));
    assert!(list.refuse(&cellar).is_some() && list.refuse(&attic).is_none());
    let list = with(Revocation::now(Revoked::Certificate(cellar.above[0].to_string()), ""));
    assert!(list.refuse(&cellar).is_some() && list.refuse(&attic).is_none(), "an issuer takes with it what it certified");
    fs::write(&path, "{\"name\":\"attic\",\"at\":1}\nnonsense\n").unwrap();
    assert!(Revocations::read(&path).unwrap_err().contains("revoked:2:"));
}
