/** Who is at the desk, and the way in with a key. */

import { signal } from "@preact/signals";

import { signIn } from "../core/app";
import { storedKey } from "../core/session";
import * as state from "../core/state";

const text = signal("");

export function SignIn() {
  const hello = state.hello.value;
  const key = storedKey();
  const submit = (event: Event): void => {
    event.preventDefault();
    if (text.value.trim() === "") return;
    void signIn(text.value.trim());
    text.value = "";
  };
  if (hello !== null && key !== null)
    return (
      <div class="sign-in">
        <span class="note" data-testid="actor">
          {hello.actor} ({hello.role})
        </span>
        <button type="button" onClick={() => void signIn(null)}>
          Sign out
        </button>
      </div>
    );
  return (
    <form class="sign-in" onSubmit={submit}>
      <label>
        <span class="note">{hello === null ? "Key" : "Reading only. Key"}</span>
        <input
          type="password"
          autocomplete="current-password"
          value={text.value}
          onInput={(event) => (text.value = event.currentTarget.value)}
        />
      </label>
      <button type="submit">Sign in</button>
      {state.refused.value !== null && <p class="verdict bad" role="alert">Not signed in: {state.refused.value}</p>}
    </form>
  );
}
